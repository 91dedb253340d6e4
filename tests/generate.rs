//! Specs of any size, written as people write them.

/// What all experiments share.
const HEAD: &str = r#"edition "2026"

let reward = sinusoids()
let domain = grid(-2.0, 2.0, points: 1001)
let canvas = grid(-2.0, 2.0, points: 401)

/// How far a loss lies above the least.
let normalised(loss: Array, by: Array) = (loss - min(loss, over: n)) / by
"#;

/// One experiment: what `{i}` and `{seeds}` stand for tells one from the next.
const EXPERIMENT: &str = r#"
/// How decisions depend on the data: the noise is 0.{i}.
experiment study_{i} {
    param seeds: Int = {seeds}          /// repetitions
    param members: Int = 4              /// ensemble size
    param degree: Int = 5
    profile paper { seeds = {seeds}, members = 4, degree = 5 }

    axis seed = 0..seeds
    axis n = [10, 40]
    axis ke = { "WCM": wcm(), "MA": ma(), "BCM": bcm(), "CVaR": cvar(alpha: 0.1) }

    // Bootstrapped polynomials, which disagree where there are no data.
    let data = sample(reward, n: n, noise: 0.{i})
    let test = sample(reward, n: 100, noise: 0.{i}, stream: "test")
    let model = train(
        ensemble(linear_map(features: polynomial(degree: degree)), members: members, prior_network: false),
        on: data)
    let single = train(linear_map(features: polynomial(degree: degree)), on: data)

    let curves = predict(model, at: canvas)
    let decision = argmax(model, ke: ke, among: domain)
    let alone = greedy(single, among: domain)

    measure error = rmse(single, on: test)
    measure spread = mean(std(curves, over: member), over: x)
    measure gap = regret(decision, under: reward)
    measure hope = hallucination(decision, under: reward)
    measure gap_alone = regret(alone, under: reward)
    measure price = normalised(gap, by: gap_alone)
    measure average = mean(gap, over: [n, ke])
    measure least = min(gap[ke: ["WCM", "MA"]], over: ke) + 1.0

    figure "study {i} gap" = plot(
        [curve(gap, x: n, by: ke, label: "ensemble"), curve(gap_alone, x: n, label: "alone")],
        x_label: "number of observations", y_label: "optimality gap")
    figure "study {i} curves" = plot([
        curve(mean(curves, over: member), x: x, by: n),
        band(mean(curves[n: 10], over: member), spread: std(curves[n: 10], over: member), x: x),
    ])
    table "study {i}" = table([gap, hope, price], rows: ke, columns: n)

    claim "pessimism costs less than optimism" : gap[ke: "WCM"] < gap[ke: "BCM"]
    claim "hallucination is less under pessimism, for most seeds" :
        share(hope[ke: "WCM"] <= hope[ke: "BCM"], over: seed) >= 0.9
    claim "more data help" : error[n: 40] < error[n: 10] * 1.1 + 0.01
}
"#;

/// The nodes of one experiment: those that there always are, and those for each seed.
const NODES: (usize, usize) = (12, 92);

/// One experiment of ten nodes.
const SMALL: &str = r#"edition "2026"

experiment small {
    axis n = [10, 40]
    let data = sample(sinusoids(), n: n)
    let model = train(linear_map(features: polynomial(degree: 5)), on: data)
    measure error = rmse(model, on: data)
    measure far = support_distance(data, at: grid(-2.0, 2.0, points: 5))
    figure "error" = lines(error, x: n)
    claim "more data help" : error[n: 40] < error[n: 10]
}
"#;

/// How many layers a layered spec has.
const LAYERS: usize = 10;

/// The first lines of a layered spec.
const LAYERED: &str = r#"edition "2026"

experiment layered {
    let far = reward_at(sinusoids(), at: grid(-2.0, 2.0, points: 5))
"#;

/// A spec of so many definitions, one a line, in ten layers. Each rests on three of the layer before,
/// and a table shows the last.
///
/// - `value`: of a definition, by its place in the layer and the names of the three.
pub(crate) fn layered(lines: usize, value: impl Fn(usize, [String; 3]) -> String) -> String {
    let width = lines / LAYERS;
    let name = |layer: usize, i: usize| format!("n{layer}_{}", i % width);
    let mut text = LAYERED.to_owned();
    for (layer, i) in (0..LAYERS).flat_map(|layer| (0..width).map(move |i| (layer, i))) {
        let value = match layer {
            0 => format!("far * {i}.5"),
            _ => value(i, [0, 1, 2].map(|k| name(layer - 1, i + k))),
        };
        text.extend(["    let ", &name(layer, i), " = ", &value, "\n"]);
    }
    let last: Vec<String> = (0..width).map(|i| name(LAYERS - 1, i)).collect();
    text + &format!("    table \"last\" = table([{}], rows: x)\n}}\n", last.join(", "))
}

/// A spec of about so many lines and nodes, the least of ten nodes.
pub(crate) fn spec(lines: usize, nodes: usize) -> String {
    if nodes <= 10 {
        return SMALL.to_owned();
    }
    let experiments = (lines / EXPERIMENT.lines().count()).max(1);
    let seeds = (nodes / experiments).saturating_sub(NODES.0).div_euclid(NODES.1).max(1);
    let mut text = HEAD.to_owned();
    for i in 0..experiments {
        let named = EXPERIMENT.replace("{i}", &i.to_string());
        text += &named.replace("{seeds}", &seeds.to_string());
    }
    text
}
