//! Figures and tables.
//!
//! An operation arranges what it gathered (`arrange`), says what to draw (`drawing`) and has
//! it rendered (`render`). Layers are drawn later, by `plot`.

mod arrange;
mod band;
mod bars;
mod columns;
mod curve;
mod drawing;
mod driven;
mod heat;
mod heatmap;
mod histogram;
mod interval;
mod latex;
mod layer;
mod legend;
mod level;
mod lines;
mod log;
mod looks;
mod marbles;
mod marks;
mod page;
mod panels;
mod paths;
mod picture;
mod plot;
mod points;
mod range;
mod render;
mod scale;
mod scatter;
mod shapes;
mod table;
mod text;
mod transition_graph;
mod view;
mod ways;

use ivx_op::Registry;

pub use band::Band;
pub use bars::Bars;
pub use curve::Curve;
pub use drawing::{Form, Mark, Series, Sign, Stroke, Tint, Way};
pub use driven::Driven;
pub use heatmap::Heatmap;
pub use histogram::Histogram;
pub use interval::Lacks;
pub use layer::Layer;
pub use level::Level;
pub use lines::Lines;
pub use marbles::Marbles;
pub use paths::Paths;
pub use picture::Pictured;
pub use plot::Plot;
pub use points::Points;
pub use scatter::Scatter;
pub use table::Tabulate;
pub use transition_graph::TransitionGraph;

/// Adds what this folder declares.
#[must_use]
pub fn register(registry: Registry) -> Registry {
    registry
        .op::<Band>()
        .op::<Bars>()
        .op::<Curve>()
        .op::<Driven>()
        .op::<Heatmap>()
        .op::<Histogram>()
        .op::<Level>()
        .op::<Lines>()
        .op::<Marbles>()
        .op::<Paths>()
        .op::<Pictured>()
        .op::<Plot>()
        .op::<Points>()
        .op::<Scatter>()
        .op::<Tabulate>()
        .op::<TransitionGraph>()
}

#[cfg(test)]
mod tests {
    use ivx_op::{Array, Artifact, Bytes, Call, Ctx, Figure, Gathered, Lit, Registry, Table};

    use super::arrange::tests::value;
    use super::register;

    /// What an operation makes of a value over `ke` and `x`, other arguments by default.
    fn run(name: &'static str, port: &str, given: &[(&str, &str)]) -> Bytes {
        let registry = register(Registry::default());
        let decl = registry.decl(name).unwrap();
        let defaults =
            decl.args.iter().filter_map(|arg| Some((arg.name.to_owned(), arg.default.clone()?)));
        let given = given.iter().map(|(arg, axis)| ((*arg).to_owned(), Lit::from(vec![*axis])));
        let Gathered { dims, values, name: called } =
            value(&[("ke", &["WCM", "MA"]), ("x", &["0", "1"])], &[1.0, 2.0, 3.0, 4.0]).0;
        let values = values.iter().map(|array: &Array| array.encode().into()).collect();
        let ports = [(port.to_owned(), vec![Gathered { dims, values, name: called }])];
        let call = Call { args: defaults.chain(given).collect(), ports: ports.into() };
        registry.run(name, &call, &Ctx::new(name, 0, None)).unwrap()
    }

    #[test]
    fn figures_and_tables_are_the_same_bytes_every_time() {
        let lines = || run("lines", "y", &[("x", "x"), ("by", "ke")]);
        let bars = || run("bars", "y", &[("by", "x")]);
        let table = || run("table", "values", &[("rows", "ke"), ("columns", "x")]);
        assert_eq!((lines(), bars(), table()), (lines(), bars(), table()));
        assert_ne!(lines(), run("lines", "y", &[("x", "x")]));
        assert!(Figure::decode(&lines()).unwrap().files["svg"].contains(">WCM<"));
        let csv = Table::decode(&table()).unwrap().files["csv"].clone();
        assert_eq!(csv, "ke,\"y, x = 0\",\"y, x = 1\"\nWCM,1.0,2.0\nMA,3.0,4.0\n");
    }
}
