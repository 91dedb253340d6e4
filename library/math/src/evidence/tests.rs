use ivx_op::Ctx;

use super::*;

fn close(x: f64, y: f64, by: f64) {
    assert!(x == y || (x - y).abs() < by, "{x} and {y}");
}

#[test]
fn without_a_tail_it_is_students_interval() {
    // Mean 3, s² = 2.5, s/√5 = √0.5; tables give t_{4, 0.975} = 2.776445.
    let (low, high) = Evidence::Mean(Spread::of_mean(&[1.0, 2.0, 3.0, 4.0, 5.0])).interval(0.95);
    let half = 2.776_445_105 * 0.5_f64.sqrt();
    close(low, 3.0 - half, 1e-8);
    close(high, 3.0 + half, 1e-8);
    // P(T_4 > 3 / √0.5) = 0.00662 by tables of t: between 0.005 (4.604) and 0.01 (3.747).
    let p = Evidence::Mean(Spread::of_mean(&[1.0, 2.0, 3.0, 4.0, 5.0])).p_above(0.0, false);
    close(p, 0.006_618, 1e-6);
}

#[test]
fn a_level_is_where_its_interval_ends() {
    let mut rng = Ctx::new("test", 0, None).rng("bootstrap", &[]);
    for n in [5, 9, 20, 60] {
        let xs: Vec<f64> = (0..n).map(|i| real(i * i % 7 + i % 3)).collect();
        let all = [
            Evidence::Mean(Spread::of_mean(&xs)),
            Evidence::Share { k: n / 3, n },
            Evidence::ranks(&xs),
            Evidence::bootstrap(&xs, &mut rng),
        ];
        for evidence in all {
            let (low, high) = evidence.interval(0.9);
            assert!(low <= evidence.estimate() && evidence.estimate() <= high, "{evidence:?}");
            if high.is_finite() {
                assert!(evidence.p_below(high + 1e-6, true) <= 0.0505, "{n} {evidence:?}");
                assert!(evidence.p_below(high - 0.3, true) >= 0.045, "{n} {evidence:?}");
            }
            if low.is_finite() {
                assert!(evidence.p_above(low - 1e-6, true) <= 0.0505, "{n} {evidence:?}");
            }
        }
    }
}

#[test]
fn a_tail_stretches_its_side_and_shortens_the_other() {
    let xs = [0.0, 0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 3.0];
    let spread = Spread::of_mean(&xs);
    let (low, high) = Evidence::Mean(spread).interval(0.95);
    let plain = Evidence::Mean(Spread { tail: 0.0, ..spread });
    let (from, to) = plain.interval(0.95);
    assert!(from < low && to < high, "{low} {high}");
    let (mirrored, _) = Evidence::Mean(Spread::of_mean(&xs.map(|x| -x))).interval(0.95);
    assert_eq!(mirrored, -high);
    // No tail, no stretch, at any number of seeds; a rare large one, and the end is open.
    for n in [5, 7, 10, 15, 20, 50, 1000] {
        assert_eq!(stretch(0.0, n), 1.0);
        assert!(stretch(1.0, n) > 100.0);
        assert!(stretch(-1.0, n) >= 0.8 && stretch(0.1, n) >= stretch(0.05, n));
    }
    // At 10 seeds: e^{20 (0.29 − 0.19)}; at 40 half of 0.3 is beyond 0.15: e^{8 · 0.15}.
    close(stretch(0.29, 10), 2.0_f64.exp(), 1e-9);
    close(stretch(0.3, 40), 1.2_f64.exp(), 1e-9);
}

#[test]
fn exchanges_find_the_tail_of_a_mean() {
    let xs = [0.3, 1.0, 1.5, 7.0, 2.0];
    let exchanged: Vec<f64> = (0..5)
        .flat_map(|i| (1..5).map(move |step| mean(&xs) + (xs[(i + step) % 5] - xs[i]) / 5.0))
        .collect();
    let spread = Spread::of_resamples(mean(&xs), &[0.0, 1.0], &exchanged, 5);
    close(spread.tail, Spread::of_mean(&xs).tail, 1e-12);
}

#[test]
fn equal_numbers_leave_no_width_and_little_certainty() {
    let spread = Evidence::Mean(Spread::of_mean(&[2.0; 20]));
    assert_eq!(spread.interval(0.95), (2.0, 2.0));
    close(spread.p_below(3.0, false), 0.95_f64.powi(20), 1e-12);
    assert_eq!((spread.p_below(2.0, false), spread.p_above(3.0, true)), (1.0, 1.0));
}

#[test]
fn signed_ranks_by_hand() {
    // 1, 2, 3: means of pairs 1, 1.5, 2, 2, 2.5, 3; one of eight choices of signs has no rank above 0.
    let ranks = Evidence::ranks(&[3.0, 1.0, 2.0]);
    assert_eq!(ranks.estimate(), 2.0);
    assert_eq!(ranks.p_above(0.0, false), 0.125);
    assert_eq!(ranks.interval(0.7), (1.0, 3.0));
    assert_eq!(ranks.interval(0.95), (f64::NEG_INFINITY, f64::INFINITY));
}
