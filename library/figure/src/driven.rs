//! Where cars drove.

use std::collections::BTreeSet;

use ivx_data::{Place, RoadMap, Rollouts, told_by};
use ivx_op::{
    AxisNames, Ctx, Dim, Everything, Facts, Figure, Gathered, Op, OpError, Wrong, declare,
};

use super::arrange::left_over;
use super::drawing::{Axis, Drawing, Mark, Series, Sign, Way};
use super::page::{count, side_by_side};
use super::panels::{panels, spelled};
use super::render::render;
use super::view::{View, alone, around, both};

declare! {
    /// What was driven, on the roads from above (Figures 3.2, 3.7 and A.2): paths from a circle to an arrow, or to a cross
    /// where the last step has an infraction. Without episodes it is the roads and the route of a task alone, from a circle
    /// to a square (Figures 3.8 and A.1).
    ///
    /// Each panel shows what is 20 m about its paths and routes, a metre being as high as it is wide; panels of the same
    /// roads show the same part.
    pub struct Driven = "driven" @ 1 -> Figure {
        /// The episodes, of a world that tells where one is; without, roads and routes alone are shown.
        of: Option<Everything<Rollouts>>;
        /// The roads, as `road_map` has them; without, paths alone are shown.
        on: Option<Everything<RoadMap>>;
        /// Axes that have a colour and legend entry for each label.
        by: AxisNames = Vec::<&str>::new();
        /// Axes that have a panel for each label; those of the last stand side by side.
        facet: AxisNames = Vec::<&str>::new();
        /// What tells where one is, in metres to the right and down.
        places: Vec<String> = vec!["x", "y"];
        /// How many are drawn: the first of each.
        episodes: usize = 6, in 1.0..=1e6;
        /// What is told of those steps that are dark red, where it is above 0.
        shade: String = "";
        /// `paths`, or `points`: every place that anybody was at.
        style: String = "paths";
        /// Above the panels.
        title: String = "";
    }
    rule fits;
}

/// What the world tells of a step that went wrong.
const FAULT: &str = "infraction";

/// Pixels that all panels have side by side, and one of them.
const ROOM: f64 = 780.0;
const SIDE: (f64, f64) = (120.0, 300.0);

/// Metres that an arrow looks back.
const BACK: f64 = 1.0;

/// A label of the axes in `by`, and what was driven there.
type Group = (String, Vec<Drive>);

/// An episode.
struct Drive {
    way: Vec<Place>,
    shaded: Vec<Vec<Place>>,
    is_fault: bool,
}

impl Op for Driven {
    fn run(&self, _: &Ctx) -> Result<Figure, OpError> {
        let nowhere =
            || Gathered { dims: Vec::new(), values: vec![RoadMap::default()], name: String::new() };
        let maps = &self.on.as_ref().map_or_else(nowhere, |on| on.0.clone());
        let facets = self.dims(&self.facet)?;
        let (names, columns) = panels(&facets);
        let columns = if columns == 0 { side_by_side(names.len()) } else { columns };
        let mut shown = Vec::new();
        for chosen in coordinates(&facets) {
            shown.push((map(maps, &chosen)?, self.groups(&chosen)?));
        }
        let parts = parts(maps, &shown)?;
        let (wide, high) = if facets.is_empty() {
            alone(parts[0])
        } else {
            let side = (ROOM / count(columns) - 14.0).floor().clamp(SIDE.0, SIDE.1);
            (side, side)
        };
        let (mut series, mut size) = (Vec::new(), (wide, high));
        for ((name, (map, groups)), part) in names.into_iter().zip(shown).zip(parts) {
            let view = View::of(part, (wide, high));
            size = view.size();
            let all = self.series(&view, &maps.values[map], groups);
            series.extend(all.into_iter().map(|own| Series { panel: name.clone(), ..own }));
        }
        let axis = |long| Axis { range: Some((0.0, long)), bare: true, ..Axis::default() };
        let (x, y) = (axis(size.0), axis(size.1));
        let (title, size) = (self.title.clone(), Some(size));
        Ok(render(&Drawing { title, x, y, series, columns, size, ..Drawing::default() }))
    }
}

impl Driven {
    /// The dimensions of these names.
    fn dims(&self, names: &AxisNames) -> Result<Vec<Dim>, OpError> {
        let (of, on) = (self.of.iter().map(|of| &of.0.dims), self.on.iter().map(|on| &on.0.dims));
        let all: Vec<&Dim> = of.chain(on).flatten().collect();
        let named = |name: &String| {
            let found = all.iter().find(|dim| dim.name == *name).map(|dim| (*dim).clone());
            found.ok_or_else(|| OpError::Failed(format!("nothing varies over `{name}`")))
        };
        names.0.iter().map(named).collect()
    }

    /// What was driven in a panel.
    fn groups(&self, chosen: &[(&str, String)]) -> Result<Vec<Group>, OpError> {
        let Some(Everything(of)) = &self.of else { return Ok(Vec::new()) };
        let by = self.dims(&self.by)?;
        let group = |(label, own): (String, Vec<(&str, String)>)| {
            let mut drives = Vec::new();
            for i in picked(of, &[chosen, &own].concat()) {
                drives.extend(self.drives(&of.values[i])?);
            }
            Ok((label, drives))
        };
        spelled(&by).into_iter().zip(coordinates(&by)).map(group).collect()
    }

    /// The first episodes of some.
    fn drives(&self, of: &Rollouts) -> Result<Vec<Drive>, OpError> {
        let column = |name: &String| {
            let why = || {
                let told = of.tells.join(", ");
                OpError::Failed(format!("the world tells no `{name}`, but {told}"))
            };
            of.tells.iter().position(|told| told == name).ok_or_else(why)
        };
        let [x, y] = [column(&self.places[0])?, column(&self.places[1])?];
        let shade = if self.shade.is_empty() { None } else { Some(column(&self.shade)?) };
        let fault = of.tells.iter().position(|told| told == FAULT);
        let told = |step: usize, at: usize| f64::from(of.told[step * of.tells.len() + at]);
        let drive = |(_, done, steps, _): (usize, usize, usize, _)| {
            let way: Vec<Place> =
                (done..done + steps).map(|step| [told(step, x), told(step, y)]).collect();
            let mut shaded: Vec<Vec<Place>> = Vec::new();
            let mut goes_on = false;
            for i in 0..steps {
                let is_shaded = shade.is_some_and(|at| told(done + i, at) > 0.0);
                match shaded.last_mut().filter(|_| goes_on) {
                    Some(run) if is_shaded => run.push(way[i]),
                    _ if is_shaded => shaded.push(way[i.saturating_sub(1)..=i].to_vec()),
                    _ => {}
                }
                goes_on = is_shaded;
            }
            let is_fault = fault.is_some_and(|at| steps > 0 && told(done + steps - 1, at) > 0.0);
            Drive { way, shaded, is_fault }
        };
        Ok(of
            .paths
            .each()
            .take(self.episodes)
            .map(drive)
            .filter(|drive| !drive.way.is_empty())
            .collect())
    }

    /// What a panel shows. Those that have colours come first.
    fn series(&self, view: &View, map: &RoadMap, groups: Vec<Group>) -> Vec<Series> {
        let drawn = |label: &str, marks: Vec<Mark>| Series {
            label: label.to_owned(),
            marks,
            ..Series::default()
        };
        let mut all = Vec::new();
        let mut drives = Vec::new();
        for (label, own) in groups {
            let marks = if self.style == "points" {
                Mark::Ways(Way::Dots, dots(view, &own))
            } else {
                let lines = own.iter().flat_map(|drive| view.lines(&drive.way)).collect();
                Mark::Ways(Way::Driven, lines)
            };
            all.push(drawn(&label, vec![marks]));
            drives.extend(own);
        }
        let shaded: Vec<_> =
            drives.iter().flat_map(|drive| &drive.shaded).flat_map(|run| view.lines(run)).collect();
        if !shaded.is_empty() {
            all.push(drawn(&self.shade, vec![Mark::Ways(Way::Shaded, shaded)]));
        }
        if let [from, .., to] = map.route[..] {
            all.push(drawn("route", vec![Mark::Ways(Way::Route, view.lines(&map.route))]));
            all.push(drawn("start", signs(Sign::Start, &[(from, from)], view)));
            all.push(drawn("destination", signs(Sign::Goal, &[(to, to)], view)));
        }
        if self.style != "points" {
            let starts: Vec<_> = drives.iter().map(|drive| (drive.way[0], drive.way[0])).collect();
            let ends = |is_fault: bool| {
                let own = drives.iter().filter(|drive| drive.is_fault == is_fault);
                own.map(|drive| end(&drive.way)).collect::<Vec<_>>()
            };
            for (label, sign, places) in [
                ("start", Sign::Start, starts),
                ("end", Sign::End, ends(false)),
                ("infraction at the end", Sign::Fault, ends(true)),
            ] {
                if !places.is_empty() {
                    all.push(drawn(label, signs(sign, &places, view)));
                }
            }
        }
        let roads = map.edges.iter().flat_map(|edge| view.lines(edge)).collect();
        let mut marks = vec![Mark::Ways(Way::Road, roads)];
        marks.extend(view.furniture());
        all.push(drawn("", marks));
        all
    }
}

/// The place of the map of a panel.
fn map(maps: &Gathered<RoadMap>, chosen: &[(&str, String)]) -> Result<usize, OpError> {
    match picked(maps, chosen)[..] {
        [map] => Ok(map),
        ref all => {
            let n = all.len();
            Err(OpError::Failed(format!("a panel has one map, and not {n}: name axes in `facet`")))
        }
    }
}

/// The part of its map that each panel shows.
fn parts(
    maps: &Gathered<RoadMap>,
    shown: &[(usize, Vec<Group>)],
) -> Result<Vec<[Place; 2]>, OpError> {
    let maps = &maps.values;
    let own = |(map, groups): &(usize, Vec<Group>)| {
        let drives = groups.iter().flat_map(|(_, drives)| drives);
        around(drives.flat_map(|drive| &drive.way).chain(&maps[*map].route))
    };
    let all: Vec<Option<[Place; 2]>> = shown.iter().map(own).collect();
    let part = |(map, _): &(usize, Vec<Group>)| {
        let alike = shown.iter().zip(&all).filter(|((other, _), _)| maps[*other] == maps[*map]);
        let here = alike.filter_map(|(_, part)| *part).reduce(both);
        let whole = || around(maps[*map].edges.iter().flatten());
        here.or_else(whole).ok_or_else(|| OpError::Failed("there is nothing to show".to_owned()))
    };
    shown.iter().map(part).collect()
}

/// The labels of each coordinate of these dimensions, last fastest.
fn coordinates(dims: &[Dim]) -> Vec<Vec<(&str, String)>> {
    dims.iter().fold(vec![Vec::new()], |heads, dim| {
        let with =
            |head: &Vec<(_, _)>, i| [&head[..], &[(&*dim.name, dim.labels.text(i))]].concat();
        heads.iter().flat_map(|head| (0..dim.len()).map(move |i| with(head, i))).collect()
    })
}

/// The places of values that are at these labels, as far as they vary over them.
fn picked<A>(of: &Gathered<A>, chosen: &[(&str, String)]) -> Vec<usize> {
    let is_there = |i: &usize| {
        let mut rest = *i;
        of.dims.iter().rev().all(|dim| {
            let at = rest % dim.len();
            rest /= dim.len();
            let said = chosen.iter().find(|(name, _)| *name == dim.name);
            said.is_none_or(|(_, label)| *label == dim.labels.text(at))
        })
    };
    (0..of.values.len()).filter(is_there).collect()
}

/// Every place that anybody was at, to half a pixel; those that lie beside each other in a row are a line.
#[expect(clippy::cast_possible_truncation, reason = "pixels are few")]
fn dots(view: &View, drives: &[Drive]) -> Vec<Vec<(f64, f64)>> {
    let halves: BTreeSet<[i32; 2]> = drives
        .iter()
        .flat_map(|drive| &drive.way)
        .filter(|place| place.iter().all(|x| x.is_finite()))
        .map(|place| view.at(*place))
        .map(|(x, y)| [(2.0 * y).round() as i32, (2.0 * x).round() as i32])
        .collect();
    let mut rows: Vec<[i32; 3]> = Vec::new();
    for [y, x] in halves {
        match rows.last_mut() {
            Some([row, _, to]) if (*row, *to + 1) == (y, x) => *to = x,
            _ => rows.push([y, x, x]),
        }
    }
    let half = |n: i32| f64::from(n) / 2.0;
    let line = |[y, from, to]: [i32; 3]| {
        let (first, last) = ((half(from), half(y)), (half(to), half(y)));
        if from == to { vec![first] } else { vec![first, last] }
    };
    rows.into_iter().map(line).collect()
}

/// Where a way ends, and where it was a little before.
fn end(way: &[Place]) -> (Place, Place) {
    let last = way[way.len() - 1];
    let is_back = |place: &&Place| (place[0] - last[0]).hypot(place[1] - last[1]) >= BACK;
    (last, way.iter().rev().find(is_back).copied().unwrap_or(last))
}

/// Signs at places to which one came from others, one for each pixel.
fn signs(sign: Sign, places: &[(Place, Place)], view: &View) -> Vec<Mark> {
    let mut seen = BTreeSet::new();
    let mut marks = Vec::new();
    for (at, from) in places {
        let (at, from) = (view.at(*at), view.at(*from));
        if seen.insert([at.0, at.1].map(|along| along.round().to_string())) {
            marks.push(Mark::Sign { sign, at, from });
        }
    }
    marks
}

fn fits(facts: &Facts<'_>) -> Result<(), Wrong> {
    let wrong = |arg, message: String, help: &str| Err(Wrong { arg, message, help: help.into() });
    left_over(facts, "of", &["by", "facet"], 0, "name it in `by` or `facet`")?;
    left_over(facts, "on", &["facet"], 0, "name it in `facet`")?;
    let places: Vec<String> = facts.arg("places").unwrap_or_default();
    if places.len() != 2 {
        let message = format!("a place on a map is two numbers, and not {}", places.len());
        return wrong("places", message, "write `places: [\"x\", \"y\"]`");
    }
    let shade: String = facts.arg("shade").unwrap_or_default();
    match facts.arg::<String>("style").as_deref() {
        None | Some("paths") => {}
        Some("points") if shade.is_empty() => {}
        Some("points") => {
            let message = "`shade` is drawn along paths".to_owned();
            return wrong("shade", message, "leave it out, or `style: \"points\"`");
        }
        Some(style) => {
            let message = format!("no style is called `{style}`");
            return wrong("style", message, "write `\"paths\"` or `\"points\"`");
        }
    }
    if !facts.is_given("of") && !facts.is_given("on") {
        let message = "there is nothing to show".to_owned();
        return wrong("of", message, "give episodes, or the roads alone: `on: road_map(..)`");
    }
    if !facts.is_given("of") {
        let given = ["by", "shade"].into_iter().find(|arg| facts.is_given(arg));
        let Some(arg) = given else { return Ok(()) };
        let message = format!("`{arg}` is said of episodes, and there are none");
        return wrong(arg, message, "give some: `of: act(..)`");
    }
    let Some(told) = facts.shapes("of").and_then(told_by) else { return Ok(()) };
    for (arg, name) in places.iter().map(|name| ("places", name)).chain([("shade", &shade)]) {
        if !name.is_empty() && !told.contains(name) {
            let message = format!("the world tells no `{name}`");
            return wrong(arg, message, &format!("it tells {}", told.join(", ")));
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests;
