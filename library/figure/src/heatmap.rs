//! Colours over a grid.

use ivx_data::Picture;
use ivx_op::{
    Array, AxisNames, Ctx, Everything, Facts, Figure, One, Op, OpError, Word, Wrong, declare,
    shown_roughly, shown_to,
};

use super::arrange::{Arranged, arrange, labels, left_over, names};
use super::drawing::{Axis, Colours, Drawing, Mark, Series};
use super::panels::panels;
use super::render::render;

declare! {
    /// A cell for each label of `x`, and of `y` where it is given, with a colour that says how much `z` is
    /// there; over `seed`, its mean.
    ///
    /// Without `y`, the labels of `x` are laid out as the places of a grid, row after row from the top. A
    /// cell whose value is not finite is crossed out.
    pub struct Heatmap = "heatmap" @ 5 -> Figure {
        /// What the colours say.
        z: Everything<Array>;
        /// The axis along the bottom; alone, the places of a grid.
        x: AxisNames;
        /// The axis along the side, first label lowest; beside a picture first label at the top, as in the picture.
        y: AxisNames = Vec::<&str>::new();
        /// Axes that have a panel for each label; those of the last stand side by side.
        facet: AxisNames = Vec::<&str>::new();
        /// How many places of a grid a row has; where 0, as many as there are rows if that is possible, and
        /// else all of them.
        columns: u64 = 0;
        /// Labels of `x` whose cells have a frame.
        marked: Vec<Word> = Vec::<i64>::new();
        /// What the first and the last colour are: the lowest and the highest value of all (`shared`), or of
        /// each panel (`panel`), where equal values have the first.
        scale: String = "shared";
        /// Above the panels.
        title: String = "";
        /// What the colours measure; where empty, what the spec calls `z`.
        z_label: String = "";
        /// Whether means are made of what is there where some of it is missing, because a node failed.
        skip_missing: bool = false;
        /// A picture in a first panel as large as the others, such as the `scene` of a world whose cells these are: then
        /// `facet` takes one axis at most, and up to six panels stand in a row.
        beside: Option<One<Picture>>;
        /// Above the picture.
        beside_label: String = "world";
    }
    rule fits;
}

impl Op for Heatmap {
    fn run(&self, _: &Ctx) -> Result<Figure, OpError> {
        let [outer, inner] = [[&self.facet.0[..], &self.y.0].concat(), self.x.0.clone()];
        let all = arrange(&self.z, (&outer, &inner), self.skip_missing)?.at_most(0, REMEDY)?;
        let per_panel = per_panel(&self.scale).map_err(OpError::Failed)?;
        let (facets, ys) = all.outer.split_at(self.facet.0.len());
        let (mut panel_names, mut columns) = panels(facets);
        let label = if self.z_label.is_empty() { &all.name } else { &self.z_label };
        if self.beside.is_some() {
            columns = (panel_names.len() + 1).min(ROW);
            self.name_beside(&mut panel_names, label)?;
        }
        let across = self.across(&all, ys.is_empty());
        let all_means: Vec<f64> = all.cells.iter().map(|cell| cell.mean).collect();
        let shared = ends(&all_means);

        let texts = texts(&all_means);
        let n_cells = all_means.len() / panel_names.len();
        let per_panel_cells = all_means.chunks(n_cells).zip(texts.chunks(n_cells));
        let series = panel_names.into_iter().zip(per_panel_cells).map(|(panel, cells)| {
            let ends = if per_panel { ends(cells.0) } else { shared };
            Series {
                panel,
                marks: self.cells(&all, ys.is_empty(), across, cells, ends),
                ..Series::default()
            }
        });
        let (x, mut y) = axes(&all, ys, across, n_cells);
        if self.goes_down(ys.is_empty()) {
            y.names.reverse();
        }
        let ends = match (per_panel, shared) {
            (false, Some((low, high))) => {
                let text = |end: f64| all_means.iter().position(|x| *x == end).map(|i| &texts[i]);
                (text(low).cloned().unwrap_or_default(), text(high).cloned().unwrap_or_default())
            }
            _ => ("lowest".to_owned(), "highest".to_owned()),
        };
        Ok(render(&Drawing {
            title: self.title.clone(),
            x,
            y,
            series: series.collect(),
            columns,
            lacks: all.lacks(),
            colours: Some(Colours { label: label.clone(), ends }),
            picture: self
                .beside
                .as_ref()
                .map(|One(picture)| (self.beside_label.clone(), picture.clone())),
            ..Drawing::default()
        }))
    }
}

impl Heatmap {
    /// Whether rows of cells go down from the top.
    fn goes_down(&self, is_grid: bool) -> bool {
        is_grid || self.beside.is_some()
    }

    /// Gives a panel without a name one of its own beside a picture.
    fn name_beside(&self, panels: &mut [String], label: &str) -> Result<(), OpError> {
        for panel in panels {
            if panel.is_empty() {
                if label.is_empty() { "value" } else { label }.clone_into(panel);
            }
            if *panel == self.beside_label {
                let why = format!(
                    "two panels are called `{panel}`: give that of the picture another name by `beside_label`"
                );
                return Err(OpError::Failed(why));
            }
        }
        Ok(())
    }

    /// How many cells a row has.
    fn across(&self, all: &Arranged, is_grid: bool) -> usize {
        let n: usize = all.inner.iter().map(ivx_op::Dim::len).product();
        let given = usize::try_from(self.columns).unwrap_or(usize::MAX).min(n);
        match given {
            _ if !is_grid => n,
            0 if n.isqrt().pow(2) == n => n.isqrt(),
            0 => n,
            given => given,
        }
    }

    #[expect(clippy::cast_precision_loss, reason = "cells are few")]
    fn cells(
        &self,
        all: &Arranged,
        is_grid: bool,
        across: usize,
        (means, texts): (&[f64], &[String]),
        ends: Option<(f64, f64)>,
    ) -> Vec<Mark> {
        let coordinates = labels(&[&all.outer[self.facet.0.len()..], &all.inner].concat());
        let rows = means.len().div_ceil(across);
        let place = |i: usize| {
            let (column, row) = (i % across, i / across);
            (column as f64, if self.goes_down(is_grid) { rows - 1 - row } else { row } as f64)
        };
        let cell = |(i, &mean): (usize, &f64)| {
            let ((x, y), share) = (place(i), share(mean, ends));
            Mark::Cell { x, y, share, name: coordinates[i].clone(), value: texts[i].clone() }
        };
        let inner = labels(&all.inner);
        let is_marked =
            |i: &usize| self.marked.iter().any(|Word(label)| *label == inner[i % inner.len()]);
        let frames = (0..means.len()).filter(is_marked).map(place);
        let frames = frames.map(|(x, y)| Mark::Frame(x, y));
        means.iter().enumerate().map(cell).chain(frames).collect()
    }
}

fn axes(all: &Arranged, ys: &[ivx_op::Dim], across: usize, n: usize) -> (Axis, Axis) {
    if !ys.is_empty() {
        let axis = |dims| Axis { label: names(dims), names: labels(dims), ..Axis::default() };
        return (axis(&all.inner), axis(ys));
    }
    let bare = |n: usize, label: String| Axis {
        label,
        names: vec![String::new(); n],
        bare: true,
        ..Axis::default()
    };
    (bare(across, names(&all.inner)), bare(n.div_ceil(across), String::new()))
}

fn fits(facts: &Facts<'_>) -> Result<(), Wrong> {
    if let Some(Err(message)) = facts.arg::<String>("scale").map(|scale| per_panel(&scale)) {
        let help = "write `\"shared\"` or `\"panel\"`".to_owned();
        return Err(Wrong { arg: "scale", message, help });
    }
    if facts.is_given("beside") {
        stands_in_a_row(facts)?;
    }
    left_over(facts, "z", &["x", "y", "facet"], 0, REMEDY)
}

fn stands_in_a_row(facts: &Facts<'_>) -> Result<(), Wrong> {
    let wrong = |arg, message: &str, help: &str| {
        Err(Wrong { arg, message: message.to_owned(), help: help.to_owned() })
    };
    if facts.arg::<Vec<String>>("facet").is_some_and(|axes| axes.len() > 1) {
        let help = "name one axis in `facet`, and select a label of the others";
        return wrong("facet", "panels beside a picture are in one row, of one axis", help);
    }
    match facts.arg::<String>("beside_label").as_deref() {
        Some("") => wrong("beside_label", "the picture has no name", "say what it shows"),
        _ => Ok(()),
    }
}

/// No more panels than these are in a row with a picture.
const ROW: usize = 6;

const REMEDY: &str = "name it in `facet`";

fn per_panel(scale: &str) -> Result<bool, String> {
    match scale {
        "shared" => Ok(false),
        "panel" => Ok(true),
        _ => Err(format!("no scale is called `{scale}`")),
    }
}

/// The lowest and the highest of the finite values.
fn ends(values: &[f64]) -> Option<(f64, f64)> {
    let finite = values.iter().copied().filter(|x| x.is_finite());
    finite.map(|x| (x, x)).reduce(|(low, high), (x, _)| (low.min(x), high.max(x)))
}

fn share(x: f64, ends: Option<(f64, f64)>) -> f64 {
    match ends {
        _ if !x.is_finite() => f64::NAN,
        Some((low, high)) if high > low => (x / 2.0 - low / 2.0) / (high / 2.0 - low / 2.0),
        _ => 0.0,
    }
}

/// So many different numbers are told apart by their digits; more would not have the room, and colours tell them.
const MOST_APART: usize = 32;

/// What the cells say.
fn texts(values: &[f64]) -> Vec<String> {
    let mut finite: Vec<f64> = values.iter().copied().filter(|x| x.is_finite()).collect();
    finite.sort_by(f64::total_cmp);
    finite.dedup();
    let are_few = finite.len() <= MOST_APART;
    let texts = if are_few { shown_to(3, values) } else { shown_roughly(3, values) };
    let missing = || "n/a".to_owned();
    let texts = texts.into_iter().zip(values);
    texts.map(|(text, x)| if x.is_finite() { text.replace('-', "−") } else { missing() }).collect()
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeMap;

    use ivx_data::{Outline, Shape};
    use ivx_op::Lit;

    use super::super::arrange::tests::{axes, value};
    use super::*;

    fn heatmap(z: Everything<Array>, y: &[&str], facet: &[&str], scale: &str) -> Heatmap {
        let (x, y, facet) = (axes(&["state"]), axes(y), axes(facet));
        let none = String::new;
        let scale = scale.to_owned();
        let (title, z_label, marked) = (none(), none(), Vec::new());
        Heatmap {
            z,
            x,
            y,
            facet,
            columns: 0,
            marked,
            scale,
            title,
            z_label,
            skip_missing: false,
            beside: None,
            beside_label: "world".to_owned(),
        }
    }

    fn svg(heatmap: &Heatmap) -> String {
        heatmap.run(&Ctx::new("heatmap", 0, None)).unwrap().files["svg"].clone()
    }

    const STATES: (&str, &[&str]) = ("state", &["0", "1", "2", "3"]);

    #[test]
    fn marked_cells_have_a_frame() {
        let z = value(&[STATES], &[0.0, 1.0, 2.0, 3.0]);
        let plain = heatmap(z.clone(), &[], &[], "shared");
        let marked = Heatmap { marked: vec![Word("3".into())], ..heatmap(z, &[], &[], "shared") };
        let frames = |map: &Heatmap| svg(map).matches("stroke=\"#d55e00\"").count();
        assert_eq!((frames(&plain), frames(&marked)), (0, 1));
    }

    #[test]
    fn places_of_a_grid_go_from_the_top() {
        let z = value(&[STATES], &[0.0, 1.0, 2.0, f64::NAN]);
        let map = heatmap(z.clone(), &[], &[], "shared");
        let all = arrange(&z, (&[], &["state".into()]), false).unwrap();
        assert_eq!(map.across(&all, true), 2);
        let means = [0.0, 1.0, 2.0, f64::NAN];
        let places: Vec<(f64, f64, f64)> = map
            .cells(&all, true, 2, (&means, &texts(&means)), ends(&means))
            .iter()
            .map(|mark| match mark {
                Mark::Cell { x, y, share, .. } => (*x, *y, *share),
                other => panic!("{other:?}"),
            })
            .collect();
        assert_eq!(places[..3], [(0.0, 1.0, 0.0), (1.0, 1.0, 0.5), (0.0, 0.0, 1.0)]);
        assert!(places[3].2.is_nan());
        let found = svg(&map);
        for text in ["<title>1: 1</title>", "<title>3: n/a</title>", ">state<", ">y<", ">2<"] {
            assert!(found.contains(text), "{text} in {found}");
        }
    }

    #[test]
    fn panels_share_their_colours_or_have_their_own() {
        let dims = [("kind", &["IVE", "EVE"][..]), STATES];
        let z = || value(&dims, &[0.0, 1.0, 2.0, 3.0, 5.0, 5.0, 5.0, 5.0]);
        let shared = svg(&heatmap(z(), &[], &["kind"], "shared"));
        assert!(shared.contains(">5<") && shared.contains(">IVE<") && shared.contains(">EVE<"));
        let own = svg(&heatmap(z(), &[], &["kind"], "panel"));
        assert!(own.contains(">highest<"));
        // The four equal values have the first colour, and so has the lowest of the others.
        let first = super::super::heat::colour(0.0);
        let n_cells = |svg: &str| {
            svg.lines().filter(|line| line.contains("<title>") && line.contains(&first)).count()
        };
        assert_eq!((n_cells(&shared), n_cells(&own)), (1, 5));
    }

    #[test]
    fn two_axes_make_a_grid() {
        let z = value(&[("action", &["UP", "DOWN"]), STATES], &[0.0; 8]);
        let found = svg(&heatmap(z.clone(), &["action"], &[], "shared"));
        for text in [">UP<", ">DOWN<", ">action<", ">3<"] {
            assert!(found.contains(text), "{text} in {found}");
        }
        let left = heatmap(z, &[], &[], "shared").run(&Ctx::new("heatmap", 0, None));
        assert!(left.unwrap_err().to_string().contains("also varies over `action`"));
    }

    /// A disc in the top left of two by two cells.
    fn beside(map: Heatmap) -> Heatmap {
        let shapes = vec![Shape { outline: Outline::Circle([0.5, 0.5], 0.25), colour: [1, 2, 3] }];
        Heatmap { beside: Some(One(Picture { size: [2.0; 2], shapes })), ..map }
    }

    #[test]
    fn a_picture_stands_beside_in_panels_of_one_row() {
        let kinds = ["a", "b", "c", "d"];
        let z = value(&[("kind", &kinds), STATES], &[0.0; 16]);
        let found = svg(&beside(heatmap(z.clone(), &[], &["kind"], "shared")));
        let panels: Vec<(f64, f64)> = found
            .match_indices(r#"<svg x=""#)
            .map(|(at, _)| {
                let number = |i: usize| found[at..].split('"').nth(i).unwrap().parse().unwrap();
                (number(1), number(3))
            })
            .collect();
        // The picture's panel, the picture in it, and four of cells.
        assert_eq!((panels.len(), panels[1]), (6, (0.0, 0.0)));
        assert!(panels[2..].iter().all(|panel| panel.1 == panels[0].1), "{panels:?}");
        assert!(panels[0].0 < panels[2].0 && panels[4].0 < panels[5].0);
        // Cells are of 28 pixels, in the picture too.
        assert!(found.contains(r##"<circle cx="14" cy="14" r="7" fill="#010203"/>"##), "{found}");
        for text in [">world<", ">a<", ">d<"] {
            assert_eq!(found.matches(text).count(), 1, "{text} in {found}");
        }
        let alone = beside(heatmap(value(&[STATES], &[0.0; 4]), &[], &[], "shared"));
        assert_eq!(svg(&alone).matches(">y<").count(), 2);
        let named =
            Heatmap { beside_label: "b".into(), ..beside(heatmap(z, &[], &["kind"], "shared")) };
        let why = named.run(&Ctx::new("heatmap", 0, None)).unwrap_err().to_string();
        assert!(why.contains("two panels are called `b`"), "{why}");
    }

    #[test]
    fn beside_a_picture_one_axis_has_panels() {
        let check = |facet: &[&str], label: &str, given: &[&str]| {
            let args = [("facet", Lit::from(facet.to_vec())), ("beside_label", label.into())];
            let args = args.map(|(name, lit)| (name.to_owned(), lit)).into();
            let (over, shapes) = (BTreeMap::new(), BTreeMap::new());
            let facts = Facts { args: &args, given, over: &over, seen: &over, shapes: &shapes };
            fits(&facts).map_err(|wrong| wrong.arg)
        };
        assert_eq!(check(&["a"], "world", &["beside"]), Ok(()));
        assert_eq!(check(&["a", "b"], "world", &["beside"]), Err("facet"));
        assert_eq!(check(&["a", "b"], "world", &["z"]), Ok(()));
        assert_eq!(check(&[], "", &["beside"]), Err("beside_label"));
    }

    /// A value of one cell alone, and where that cell is from the top.
    #[test]
    fn rows_go_from_the_top_as_those_of_the_picture() {
        let two: &[&str] = &["0", "1"];
        let z = || value(&[("row", two), ("state", two)], &[7.0, 0.0, 0.0, 0.0]);
        let top = |map: &Heatmap| {
            let found = svg(map);
            let line = found.lines().find(|line| line.contains(": 7</title>")).unwrap().to_owned();
            line.split('"').nth(3).unwrap() == "0"
        };
        let upright = || heatmap(z(), &["row"], &[], "shared");
        assert!(!top(&upright()) && top(&beside(upright())));
        let flat = Heatmap { x: axes(&["row", "state"]), ..heatmap(z(), &[], &[], "shared") };
        assert!(top(&flat) && top(&beside(flat)));
        // Their labels go along.
        let z = value(&[("row", &["top", "low"]), ("state", two)], &[7.0, 0.0, 0.0, 0.0]);
        let found = svg(&beside(heatmap(z, &["row"], &[], "shared")));
        let height = |text: &str| -> f64 {
            let line = found.lines().find(|line| line.contains(text)).unwrap();
            line.split('"').nth(3).unwrap().parse().unwrap()
        };
        assert!(height(">top<") < height(">low<"), "{found}");
    }

    #[test]
    fn cells_tell_their_numbers_apart() {
        let check = |values: &[f64], expected: &[&str]| assert_eq!(texts(values), expected);
        check(&[100.1, 100.2, 100.3], &["100.1", "100.2", "100.3"]);
        check(&[999_999_999.0, 1e9], &["999999999", "1e9"]);
        check(&[-0.0, -0.0123, 1.5, f64::NAN, 1e-7], &["0", "−0.01", "1.5", "n/a", "1e−7"]);
        let many: Vec<f64> = (0..100).map(|i| 1000.0 + f64::from(i) / 700.0).collect();
        assert_eq!(texts(&many)[..2], ["1000", "1000.001"]);
        let z = value(&[STATES], &[100.1, 100.2, 100.3, 100.4]);
        let found = svg(&heatmap(z, &[], &[], "shared"));
        for text in [">100.1<", ">100.2<", ">100.3<", ">100.4<"] {
            assert!(found.contains(text), "{text} in {found}");
        }
    }
}
