//! Records as results, parts that hold artifacts and coordinates from the library, with toy
//! operations: checked, expanded and run.

use std::collections::BTreeMap;
use std::path::Path;
use std::sync::LazyLock;
use std::time::Duration;

use ivx_cache::Cache;
use ivx_engine::{
    Fate, Options, Outcome, Plan, Silence, Source, Stop, expand, platform, schedule, wanted,
};
use ivx_grammar::check::{File, Project, Settings, check};
use ivx_grammar::ir::Spec;
use ivx_grammar::{Diagnostic, parse};
use ivx_op::{
    Array, Artifact as _, Collected, Ctx, Dim, Facts, Labelled, Labels, Lit, Members, One, Op,
    OpError, Parts, Registry, Rows, Ty, Wrong, declare, family, record,
};

record! {
    /// What became of a day at the market.
    struct Sale = "Sale" {
        /// Whether each of two customers bought.
        sold: Array [customer];
        /// What came in.
        income: Array;
    }
}

trait Buyer: std::fmt::Debug + Send + Sync {
    fn limit(&self) -> f64;
}

declare! {
    /// Buys up to a price.
    struct Careful = "careful" @ 1 {
        /// The price.
        limit: One<Array>;
        /// What is added to it where it is given.
        more: Option<One<Array>>;
    }
}

impl Buyer for Careful {
    fn limit(&self) -> f64 {
        self.limit.values[0] + self.more.as_ref().map_or(0.0, |more| more.values[0])
    }
}

declare! {
    /// Buys up to the mean of what a crowd would pay.
    struct Crowd = "crowd" @ 1 {
        /// What each would pay.
        limits: Members<Array>;
    }
}

impl Buyer for Crowd {
    fn limit(&self) -> f64 {
        let limits: Vec<f64> = self.limits.iter().map(|limit| limit.values[0]).collect();
        limits.iter().sum::<f64>() / f64::from(u32::try_from(limits.len()).expect("few"))
    }
}

declare! {
    /// Buys up to the limit of one of many.
    struct Like = "like" @ 1 {
        /// The limits of all.
        of: Labelled<Array>;
        /// Whose counts.
        who: String;
    }
}

impl Buyer for Like {
    fn limit(&self) -> f64 {
        let mut all = self.of.each();
        all.find(|(labels, _)| *labels == [self.who.as_str()]).expect("is there").1.values[0]
    }
}

fn buyers() -> &'static Parts<dyn Buyer> {
    static TABLE: LazyLock<Parts<dyn Buyer>> = LazyLock::new(|| {
        Parts::<dyn Buyer>::new()
            .with(|x: Careful| Box::new(x))
            .with(|x: Crowd| Box::new(x))
            .with(|x: Like| Box::new(x))
    });
    &TABLE
}

family!(dyn Buyer, "Buyer", buyers);

declare! {
    /// A day at the market.
    struct Sell = "sell" @ 1 -> Sale {
        /// Who buys.
        to: Box<dyn Buyer>;
        /// The price.
        price: f64;
        /// What comes in for each thing sold.
        share: f64 = 1.0;
        /// What is taken of what comes in.
        tax: Option<One<Array>>;
    }
}

impl Op for Sell {
    fn run(&self, _: &Ctx) -> Result<Sale, OpError> {
        let bought = [1.0, 2.0].map(|n| f64::from(u8::from(self.price * n <= self.to.limit())));
        let customers = Labels::Names(vec!["one".to_owned(), "two".to_owned()]);
        let tax = self.tax.as_ref().map_or(0.0, |tax| tax.values[0]);
        let income = bought.iter().sum::<f64>() * self.price * self.share - tax;
        let sold = Array::series(Dim::new("customer", customers), bought.to_vec());
        Ok(Sale { sold, income: Array::scalar(income) })
    }
}

declare! {
    /// What came in, by whose it is.
    struct Tally = "tally" @ 1 -> Array [who] {
        /// What came in.
        of: Labelled<Array>;
        /// The axis whose labels tell whose.
        whose: String = "";
    }
    rule collected;
}

fn collected(facts: &Facts<'_>) -> Result<(), Wrong> {
    let (seen, whose) = (facts.seen("of"), facts.arg::<String>("whose").unwrap_or_default());
    if whose.is_empty() && seen.is_empty() || seen == [whose.as_str()] {
        return Ok(());
    }
    let message = format!("`whose` is {whose:?}, and {seen:?} is collected");
    Err(Wrong { arg: "whose", message, help: "name the axis".to_owned() })
}

impl Op for Tally {
    fn run(&self, _: &Ctx) -> Result<Array, OpError> {
        assert_eq!(self.of.axes().collect::<Vec<_>>().join(", "), self.whose);
        let who = self.of.each().map(|(labels, _)| labels.join(", ")).collect();
        let values = self.of.each().map(|(_, of)| of.values[0]).collect();
        Ok(Array::series(Dim::new("who", Labels::Names(who)), values))
    }
}

declare! {
    /// What came in, whoever's it is.
    struct Pile = "pile" @ 1 -> Array [place] {
        /// What came in.
        of: Collected<Array>;
    }
}

impl Op for Pile {
    fn run(&self, _: &Ctx) -> Result<Array, OpError> {
        let Collected(of) = &self.of;
        let values: Vec<f64> = of.values.iter().map(|of| of.values[0]).collect();
        Ok(Array::series(Dim::new("place", of.dims[0].labels.clone()), values))
    }
}

declare! {
    /// The shops there are.
    struct Shops = "shops" @ 1 {
        /// What is added to each price.
        rise: f64 = 0.0;
    }
}

impl Rows for Shops {
    fn fields() -> Vec<(&'static str, Ty)> {
        vec![("region", Ty::Str), ("price", Ty::Float)]
    }
    fn rows(&self) -> Vec<(String, Vec<Lit>)> {
        let shops = [("a", "north", 1.0), ("b", "north", 2.0), ("c", "south", 3.0)];
        let row = |(label, region, price): (&str, &str, f64)| {
            (label.to_owned(), vec![region.into(), Lit::Real(price + self.rise)])
        };
        shops.into_iter().map(row).collect()
    }
}

fn registry() -> Registry {
    let ours = ivx_library::registry().op::<Sell>().op::<Tally>().op::<Pile>();
    ours.parts(buyers()).rows::<Shops>()
}

/// A checked and expanded spec.
fn plan(text: &str) -> Plan {
    let (spec, faults) = checked(text);
    assert_eq!(faults, []);
    expand(&spec, &registry())
}

/// A spec, and what is wrong with it.
fn checked(text: &str) -> (Spec, Vec<Diagnostic>) {
    let (ast, faults) = parse(text, 0);
    assert_eq!(faults, []);
    let file = File {
        path: "toys.ivx".to_owned(),
        stem: "toys".to_owned(),
        text: text.to_owned(),
        ast: ast.into(),
        ..File::default()
    };
    let project = Project { files: vec![file] };
    check(&project, &registry(), &Settings::default())
}

fn run(plan: &Plan, cache: &Path) -> Outcome {
    let mut cache = Cache::open(cache, &platform()).expect("the cache opens");
    let options = Options {
        jobs: 2,
        memory: u64::MAX,
        fail_fast: false,
        library: "toys".to_owned(),
        checkpoint: Duration::ZERO,
        limit: None,
        stop: Stop::default(),
    };
    let wanted = wanted(plan);
    let outcome = schedule(plan, &registry(), &mut cache, &options, &wanted, &mut Silence);
    cache.close().expect("the cache closes");
    let outcome = outcome.expect("the cache works");
    for (step, node) in plan.graph.node_weights().zip(&outcome.nodes) {
        assert!(!matches!(node.fate, Fate::Failed { .. }), "{}: {:?}", step.address, node.fate);
    }
    outcome
}

/// The numbers of the measures, in the order declared.
fn values(plan: &Plan, outcome: &Outcome) -> Vec<Vec<f64>> {
    let value = |source: &Source| match source {
        Source::Node(node) => Array::decode(&outcome.values[node]).expect("an array").values,
        Source::Number(number) => vec![*number],
    };
    plan.outputs.values().map(|family| family.sources.iter().flat_map(value).collect()).collect()
}

/// How many nodes of each operation ran.
fn ran(plan: &Plan, outcome: &Outcome) -> BTreeMap<String, usize> {
    let mut ran = BTreeMap::new();
    for (step, node) in plan.graph.node_weights().zip(&outcome.nodes) {
        if matches!(node.fate, Fate::Ran { .. }) {
            *ran.entry(step.op.clone()).or_default() += 1;
        }
    }
    ran
}

const MARKET: &str = r#"edition "2026"

experiment market {
    axis shop(region, price) = shops()
    axis rich = [1.5, 2.5]
    axis kind = ["careful", "fixed"]
    let data  = sample(sinusoids(), n: 3, noise: 0.0)
    let model = train(linear_mle(features: polynomial(degree: 0)), on: data)
    let limit = rich * (2.0 + 0.0 * rmse(model, on: data))
    let buyer = match kind { "careful": careful(limit: limit), "fixed": careful(limit: 4) }
    let day   = sell(buyer, shop.price)
    measure sold   = sum(day.sold, over: customer)
    measure income = mean(day.income, over: shop, by: shop.region)
    measure kept   = day[rich: 2.5, kind: "careful"].income
}
"#;

#[test]
fn a_part_holds_what_was_computed_and_each_field_counts_on_its_own() {
    let folder = tempfile::tempdir().unwrap();
    let first = plan(MARKET);
    let outcome = run(&first, folder.path());
    // Limits 3 and 5 of the careful, 4 of the others; prices 1, 2, 3.
    let sold = [
        [[2.0, 1.0, 1.0], [2.0, 2.0, 1.0]], // careful
        [[2.0, 2.0, 1.0], [2.0, 2.0, 1.0]],
    ];
    let flat: Vec<f64> = sold.iter().flatten().flatten().copied().collect();
    // North: the mean of shops a and b; by kind, region, rich.
    let income = [2.0, 3.0, 3.0, 3.0, 3.0, 3.0, 3.0, 3.0];
    let kept = vec![2.0, 4.0, 3.0];
    assert_eq!(values(&first, &outcome), [flat, income.to_vec(), kept]);

    // The share changes every sale and every income; what is sold it leaves alone.
    let second = plan(&MARKET.replace("sell(buyer, shop.price)", "sell(buyer, shop.price, 0.5)"));
    let outcome = run(&second, folder.path());
    let ran = ran(&second, &outcome);
    assert_eq!(ran.get("sum"), None, "{ran:?}");
    assert!(ran["sell"] >= 9 && ran["mean"] >= 1, "{ran:?}");
    assert_eq!(values(&second, &outcome)[2], [1.0, 2.0, 1.5]);
}

#[test]
fn a_part_can_hold_a_whole_ensemble() {
    let text = r#"edition "2026"

experiment market {
    let data = sample(sinusoids(), n: 5, noise: 0.0)
    let models = train(ensemble(linear_mle(features: polynomial(degree: 0)), members: 3, prior_network: false), on: data)
    let limits = 5.0 + 0.0 * rmse(models, on: data)
    measure income = sell(crowd(limits), 2.0).income
}
"#;
    let folder = tempfile::tempdir().unwrap();
    let plan = plan(text);
    let outcome = run(&plan, folder.path());
    assert_eq!(values(&plan, &outcome), [[4.0]]);
}

#[test]
fn a_port_that_is_left_out_is_none_and_told_apart_from_what_is_given() {
    let text = r#"edition "2026"

experiment market {
    let data = sample(sinusoids(), n: 5, noise: 0.0)
    let none = 0.0 * rmse(train(linear_mle(features: polynomial(degree: 0)), on: data), on: data)
    let fixed = careful(2.0)
    let richer = careful(2.0, more: none + 3.0)
    measure a = sell(fixed, 2.0).income
    measure b = sell(careful(limit: 2.0), 2.0).income
    measure c = sell(careful(2.0, more: none), 2.0).income
    measure d = sell(richer, 2.0).income
    measure e = sell(fixed, 2.0, tax: none + 0.5).income
    measure f = sell(fixed, 2.0, tax: none).income
    measure g = sell(careful(2.0, more: 0.0), 2.0, tax: 0.0).income
}
"#;
    let folder = tempfile::tempdir().unwrap();
    let plan = plan(text);
    let outcome = run(&plan, folder.path());
    let ones = [2.0, 2.0, 2.0, 4.0, 1.5, 2.0, 2.0].map(|income| vec![income]);
    assert_eq!(values(&plan, &outcome), ones);
    // Only the first two are one: nothing given is another thing than nought.
    assert_eq!(ran(&plan, &outcome)["sell"], 6);
}

/// The tally and the pile of two numbers, by what they are called.
fn collecting(axis: &str) -> String {
    format!(
        r#"edition "2026"

experiment market {{
    axis colour = {{ {axis} }}
    let data = sample(sinusoids(), n: 5, noise: 0.0)
    let x = colour + 0.0 * rmse(train(linear_mle(features: polynomial(degree: 0)), on: data), on: data)
    measure tally = tally(collect(x, over: colour), whose: "colour")
    measure pile = pile(collect(x, over: colour))
    measure one = tally(x)
    measure like = sell(like(collect(x, over: colour), who: "red"), 1.0).income
}}
"#
    )
}

#[test]
fn labels_travel_with_a_collection_that_asks_for_them() {
    let folder = tempfile::tempdir().unwrap();
    let first = plan(&collecting(r#""red": 2.0, "green": 1.0"#));
    let outcome = run(&first, folder.path());
    // In the order declared with labels, by value without.
    let expected = [vec![2.0, 1.0], vec![1.0, 2.0], vec![2.0, 1.0], vec![2.0]];
    assert_eq!(values(&first, &outcome), expected);
    let tally = first.outputs.values().next().expect("is declared first").sources[0].node();
    let tally = Array::decode(&outcome.values[&tally.expect("is computed")]).expect("an array");
    let who = Labels::Names(vec!["red".to_owned(), "green".to_owned()]);
    assert_eq!(tally.dims, [Dim::new("who", who)]);

    // Other names are another thing for what asks for them, and for nothing else.
    let renamed = plan(&collecting(r#""red": 2.0, "blue": 1.0"#));
    let outcome = run(&renamed, folder.path());
    let again = ran(&renamed, &outcome);
    assert_eq!(again, [("sell", 1), ("tally", 1)].map(|(op, n)| (op.to_owned(), n)).into());
    let turned = plan(&collecting(r#""green": 1.0, "red": 2.0"#));
    let outcome = run(&turned, folder.path());
    let again = ran(&turned, &outcome);
    assert_eq!(again, [("sell", 1), ("tally", 1)].map(|(op, n)| (op.to_owned(), n)).into());
    assert_eq!(values(&turned, &outcome)[0], [1.0, 2.0]);
}

#[test]
fn a_rule_sees_what_was_collected() {
    let told = |from: &str, to: &str| {
        let text = collecting(r#""red": 2.0, "green": 1.0"#).replace(from, to);
        let (_, faults) = checked(&text);
        faults.into_iter().map(|fault| fault.message).collect::<Vec<_>>()
    };
    assert_eq!(
        told(r#"whose: "colour""#, r#"whose: "driver""#),
        [r#"`whose` is "driver", and ["colour"] is collected"#]
    );
    assert_eq!(
        told("tally(x)", r#"tally(x, whose: "colour")"#),
        [r#"`whose` is "colour", and [] is collected"#]
    );
    assert_eq!(
        told("tally(x)", "tally(data)"),
        ["`tally.of` takes Array or Collection<Array>, found Dataset"]
    );
    assert_eq!(
        told("pile(collect(x, over: colour))", "pile(x)"),
        ["expected a collection of Array, found one"]
    );
}

#[test]
fn only_what_is_selected_is_computed() {
    let text = r#"edition "2026"

experiment market {
    axis shop(region, price) = shops()
    axis limit = [1.0, 2.0, 3.0]
    let day = sell(careful(limit), shop.price)
    measure one = day[shop: "b", limit: 3.0].income
}
"#;
    let plan = plan(text);
    let ops: Vec<&str> = plan.graph.node_weights().map(|step| step.op.as_str()).collect();
    assert_eq!(ops, ["sell", "field"]);
}
