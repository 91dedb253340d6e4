//! Target networks: parameters that follow others.

use super::optim::target_update;
use super::params::{ParamId, Params};
use super::real::Real;

/// How parameters follow others that learn.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Follow {
    /// After every step a share `τ` of the way (Polyak): `θ⁻ ← (1 - τ) θ⁻ + τ θ`, an exponential
    /// moving average.
    Average(f64),
    /// After every so many steps all of it, and not at all in between.
    Copy(u64),
}

impl<F: Real> Params<F> {
    /// Moves the arrays `to` after those of `from`, one by one, when `t` steps are done.
    ///
    /// # Panics
    /// If they are not as many, of the same shapes, or an array is to follow itself.
    pub fn follow(&mut self, rule: Follow, t: u64, from: &[ParamId], to: &[ParamId]) {
        assert_eq!(from.len(), to.len(), "one array for each");
        for (&from, &to) in from.iter().zip(to) {
            assert_eq!(self.shape(from), self.shape(to), "arrays of one shape");
            let (online, target) = self.pair(from, to);
            match rule {
                Follow::Average(tau) => target_update(target, online, tau),
                Follow::Copy(every) if t.is_multiple_of(every) => target.copy_from_slice(online),
                Follow::Copy(_) => {}
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A network of two arrays at `value`, and its target at 0.
    fn nets(value: f32) -> (Params<f32>, [ParamId; 2], [ParamId; 2]) {
        let mut params = Params::default();
        let online = [2, 1].map(|n| params.add(format!("p{n}"), vec![n], vec![value; n]));
        let target = [2, 1].map(|n| params.add_fixed(format!("t{n}"), vec![n], vec![0.0; n]));
        (params, online, target)
    }

    /// The target after each of so many steps, at the end of step `t` of which parameters are `t`.
    fn path(rule: Follow, steps: u8) -> Vec<f32> {
        let (mut params, online, target) = nets(0.0);
        (1..=steps)
            .map(|t| {
                for id in online {
                    params.value_mut(id).fill(f32::from(t));
                }
                params.follow(rule, t.into(), &online, &target);
                let [x, y] = params.value(target[0]) else { panic!("two numbers") };
                assert!(x == y && params.value(target[1]) == [*x], "all arrays follow");
                assert_eq!(params.value(online[0]), [f32::from(t); 2], "and are not changed");
                *x
            })
            .collect()
    }

    #[test]
    fn copies_are_made_every_so_many_steps() {
        assert_eq!(path(Follow::Copy(3), 7), [0.0, 0.0, 3.0, 3.0, 3.0, 6.0, 6.0]);
        assert_eq!(path(Follow::Copy(1), 3), [1.0, 2.0, 3.0]);
    }

    #[test]
    fn averages_forget_exponentially() {
        // 0.5·0 + 0.5·1, 0.5·0.5 + 0.5·2, 0.5·1.25 + 0.5·3.
        assert_eq!(path(Follow::Average(0.5), 3), [0.5, 1.25, 2.125]);
        assert_eq!(path(Follow::Average(0.0), 2), [0.0, 0.0]);
        assert_eq!(path(Follow::Average(1.0), 2), path(Follow::Copy(1), 2));
    }

    /// From 0, what follows 1 is at `1 - (1 - τ)^t`.
    #[test]
    fn an_average_arrives_in_its_own_time() {
        let (mut params, online, target) = nets(1.0);
        (0..1000).for_each(|t| params.follow(Follow::Average(0.005), t, &online, &target));
        let expected = 1.0 - 0.995_f64.powi(1000);
        assert!((f64::from(params.value(target[1])[0]) - expected).abs() < 1e-5);
    }

    #[test]
    #[should_panic(expected = "arrays of one shape")]
    fn arrays_of_other_shapes_do_not_follow() {
        let (mut params, online, target) = nets(1.0);
        params.follow(Follow::Copy(1), 0, &online, &[target[1], target[0]]);
    }
}
