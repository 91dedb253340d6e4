//! Where the parts of a drawing lie.

use super::drawing::{Axis, Drawing, Mark};
use super::heat::has_room;
use super::legend;
use super::log::log_ticks;
use super::marks::Panel;
use super::picture;
use super::scale::{Scale, Ticks, scales, ticks};
use super::text::width;

/// The size of small text.
pub(super) const SMALL: f64 = 11.0;

/// Between panels, beside the room for their names.
const GAP: f64 = 14.0;

/// What a power of ten above a panel takes.
const POWER: f64 = 14.0;

/// What the name of a panel takes.
const NAME: f64 = 17.0;

/// What a line below all takes.
const NOTE: f64 = 16.0;

/// The most pixels that a unit of a diagram has.
const UNIT: f64 = 44.0;

/// Where everything lies, in pixels.
pub(super) struct Page {
    pub(super) width: f64,
    pub(super) height: f64,
    /// Of the first panel.
    left: f64,
    /// Of the first panel.
    top: f64,
    /// The first panel; the others differ in their vertical range.
    pub(super) panel: Panel,
    /// From the left of a panel to that of the next.
    across: f64,
    /// From the top of a panel to that of the next.
    down: f64,
    /// How many there are.
    pub(super) n_panels: usize,
    /// How many stand side by side.
    columns: usize,
    /// Whether the names below the panels are slanted, because they are too long.
    pub(super) slanted: bool,
    /// How far the tick labels reach below the panels.
    pub(super) below: f64,
    pub(super) x_ticks: Ticks,
    /// The vertical range of each panel.
    y: Vec<Scale>,
    /// The ticks of each panel.
    pub(super) y_ticks: Vec<Ticks>,
}

impl Page {
    /// The page of a drawing.
    pub(super) fn of(drawing: &Drawing) -> Self {
        let (x, y) = scales(drawing);
        let names = drawing.panels();
        let (n_panels, named) = (names.len(), !names[0].is_empty());
        let columns = match drawing.columns {
            0 => side_by_side(n_panels),
            columns => columns.min(n_panels),
        };
        let (panel_width, panel_height) = size(drawing, columns, named);
        let room = (panel_width, panel_height);
        let (x_ticks, y_ticks) = axis_ticks(drawing, (x, &y), room, named);
        let mut panel = Panel {
            width: panel_width,
            height: panel_height,
            x,
            y: y[0],
            log: drawing.y.log,
            valued: true,
        };
        let marks = || drawing.series.iter().flat_map(|series| &series.marks);
        panel.valued = marks().all(|mark| has_room(mark, &panel));
        let widest = |labels: &[String]| labels.iter().map(|l| width(l, SMALL)).fold(0.0, f64::max);

        let slot = panel.width / count(drawing.x.names.len().max(1));
        let slanted = !drawing.x.names.is_empty() && widest(&x_ticks.labels) > slot - 6.0;
        let below = match slanted {
            true => widest(&x_ticks.labels) * 0.64 + 20.0,
            false if drawing.x.bare => 4.0,
            false => 22.0,
        };
        // Slanted names reach to the left of their place, the first ones past the panel.
        let overhang =
            |(label, at): (&String, &f64)| width(label, SMALL) * 0.77 - x.place(*at, panel.width);
        let overhang = x_ticks.labels.iter().zip(&x_ticks.at).map(overhang).fold(0.0, f64::max);

        let has = |text: &str, room: f64| if text.is_empty() { 0.0 } else { room };
        let widest_y = y_ticks.iter().map(|ticks| widest(&ticks.labels)).fold(0.0, f64::max);
        let left = 16.0 + has(&drawing.y.label, 18.0) + widest_y;
        let left = if slanted { left.max(overhang + 8.0) } else { left };
        let power = if y_ticks.iter().all(|ticks| ticks.exponent == 0) { 0.0 } else { POWER };
        // Where each panel has its own range, each has its own labels too.
        let (labels, powers) = if drawing.y.free { (widest_y + 7.0, power) } else { (0.0, 0.0) };
        let top = 14.0 + has(&drawing.title, 22.0) + power + if named { NAME } else { 0.0 };
        let has_last_line = !drawing.x.label.is_empty() || x_ticks.exponent != 0;
        let note = if drawing.lacks.nothing() { 0.0 } else { NOTE };
        let bottom = below + if has_last_line { 22.0 } else { 4.0 } + note;

        let mut page = Self {
            width: 0.0,
            height: 0.0,
            left,
            top,
            panel,
            across: panel.width + GAP + labels,
            down: panel.height + GAP + NAME + powers,
            n_panels,
            columns,
            slanted,
            below,
            x_ticks,
            y,
            y_ticks,
        };
        let (inside, down) = page.extent();
        let (legend_width, legend_height) = legend::size(drawing, down);
        let heading = width(&drawing.title, 13.0) * 1.1 + 16.0;
        let noted = width(&drawing.lacks.told(), SMALL) + 16.0;
        page.width = (left + inside + legend_width).max(heading).max(noted).ceil();
        page.height = (top + down + bottom).max(top + legend_height + 10.0).ceil();
        page
    }

    /// The left and top of a panel.
    pub(super) fn corner(&self, panel: usize) -> (f64, f64) {
        let (column, row) = (panel % self.columns, panel / self.columns);
        (self.left + count(column) * self.across, self.top + count(row) * self.down)
    }

    /// The panel in this place.
    pub(super) fn panel(&self, place: usize) -> Panel {
        Panel { y: self.y[place], ..self.panel }
    }

    /// Whether nothing is to the left of a panel.
    pub(super) fn is_first(&self, panel: usize) -> bool {
        panel.is_multiple_of(self.columns)
    }

    /// Whether nothing is below a panel.
    pub(super) fn is_last(&self, panel: usize) -> bool {
        panel + self.columns >= self.n_panels
    }

    /// The width and height of all panels together.
    pub(super) fn extent(&self) -> (f64, f64) {
        let (right, _) = self.corner(self.columns - 1);
        let (_, last) = self.corner(self.n_panels - 1);
        (right + self.panel.width - self.left, last + self.panel.height - self.top)
    }
}

/// So many panels of one axis stand side by side.
#[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "panels are few")]
pub(super) fn side_by_side(n: usize) -> usize {
    if n <= 3 { n } else { count(n).sqrt().ceil() as usize }
}

/// How wide and high each panel is.
fn size(drawing: &Drawing, columns: usize, named: bool) -> (f64, f64) {
    if let Some(size) = drawing.size {
        return size;
    }
    let (n_names, n_series) = (drawing.x.names.len(), drawing.series.len());
    let marks = || drawing.series.iter().flat_map(|series| &series.marks);
    if marks().any(|mark| matches!(mark, Mark::Cell { .. })) {
        let (across, down) = (count(n_names.max(1)), count(drawing.y.names.len().max(1)));
        let room = if named { (640.0 / count(columns)).clamp(90.0, 220.0) } else { 400.0 };
        let largest = if named { 28.0 } else { 44.0 };
        // A cell is square, unless there are too many in one direction.
        let side = |n: f64, room: f64| (room / n).min(largest);
        let (wide, high) = (side(across, room), side(down, room.min(300.0)));
        let square = wide.min(high).max(wide / 3.0).max(high / 3.0);
        // It is broader, if that gives room for what all of them say, but beside a picture.
        let said = marks().map(|mark| match mark {
            Mark::Cell { value, .. } => width(value, 10.0) + 6.0,
            _ => 0.0,
        });
        let said = said.fold(0.0, f64::max);
        let may_be_broad = said <= room / across && drawing.picture.is_none();
        let broad = if may_be_broad { said } else { 0.0 };
        return (across * square.min(wide).max(broad), down * square.min(high));
    }
    if let Some((_, picture)) = &drawing.picture {
        return picture::size(picture);
    }
    let is_diagram = marks().any(|mark| matches!(mark, Mark::Shape { .. }));
    if let (true, Some((left, right)), Some((low, high))) =
        (is_diagram, drawing.x.range, drawing.y.range)
    {
        // A unit is as high as it is wide.
        let unit = (640.0 / (right - left)).min(UNIT);
        return ((right - left) * unit, (high - low) * unit);
    }
    if !named {
        let room_for_names = count(n_names) * (5.0 * count(n_series)).max(16.0);
        return (room_for_names.max(400.0), 250.0);
    }
    let n_labels = drawing.labels().len().max(1);
    let room_for_names = count(n_names) * (5.0 * count(n_labels)).max(14.0);
    let wide = (640.0 / count(columns) - GAP).clamp(120.0, 300.0).max(room_for_names);
    (wide, (wide * 0.7).clamp(90.0, 200.0))
}

/// The ticks of both axes: as many as there is room for.
fn axis_ticks(
    drawing: &Drawing,
    (x, y): (Scale, &[Scale]),
    (wide, high): (f64, f64),
    named: bool,
) -> (Ticks, Vec<Ticks>) {
    let of = |axis: &Axis, scale: Scale, about: u32, room: f64| match axis {
        axis if axis.bare => Ticks { at: Vec::new(), labels: Vec::new(), exponent: 0 },
        axis if axis.log => log_ticks(scale, about),
        axis if axis.names.is_empty() => ticks(scale, about),
        axis => named_ticks(axis, room),
    };
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "at most 300")]
    let about = |room: f64, each: f64| ((room / each) as u32).clamp(2, 7);
    let (about_x, about_y) = if named { (about(wide, 55.0), about(high, 28.0)) } else { (7, 6) };
    let y_ticks = y.iter().map(|y| of(&drawing.y, *y, about_y, high));
    (of(&drawing.x, x, about_x, wide), y_ticks.collect())
}

/// A tick for each name; where they would run into each other, for every few.
fn named_ticks(axis: &Axis, room: f64) -> Ticks {
    let slot = room / count(axis.names.len());
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "names are few")]
    let step = (12.0 / slot).ceil().max(1.0) as usize;
    let places = (0..).map(f64::from).zip(&axis.names).step_by(step);
    let (at, labels) = places.map(|(at, name)| (at, name.clone())).unzip();
    Ticks { at, labels, exponent: 0 }
}

#[expect(clippy::cast_precision_loss, reason = "what is drawn is not that much")]
pub(super) fn count(n: usize) -> f64 {
    n as f64
}

#[cfg(test)]
mod tests {
    use super::super::drawing::{Series, Stroke};
    use super::*;

    fn drawing(panels: &[&str], columns: usize) -> Drawing {
        let line = Mark::Line(Stroke::Solid, vec![(0.0, 0.0), (1.0, 1.0)]);
        let series = panels.iter().map(|panel| Series {
            panel: (*panel).to_owned(),
            marks: vec![line.clone()],
            ..Series::default()
        });
        Drawing { series: series.collect(), columns, ..Drawing::default() }
    }

    #[test]
    fn panels_stand_in_rows() {
        let page = Page::of(&drawing(&["a", "b", "c", "d", "e"], 2));
        let corners: Vec<(f64, f64)> = (0..5).map(|panel| page.corner(panel)).collect();
        assert_eq!((corners[0].1, corners[0].0), (corners[1].1, corners[2].0));
        assert!(corners[1].0 >= corners[0].0 + page.panel.width);
        assert!(corners[2].1 >= corners[0].1 + page.panel.height + NAME);
        let edges: Vec<(bool, bool)> =
            (0..5).map(|panel| (page.is_first(panel), page.is_last(panel))).collect();
        let (t, f) = (true, false);
        assert_eq!(edges, [(t, f), (f, f), (t, f), (f, t), (t, t)]);
        let (right, bottom) = (corners[1].0 + page.panel.width, corners[4].1 + page.panel.height);
        assert!(right < page.width && bottom < page.height);
    }

    #[test]
    fn one_panel_without_a_name_is_large() {
        let page = Page::of(&drawing(&[""], 0));
        assert_eq!((page.panel.width, page.panel.height), (400.0, 250.0));
        assert_eq!([1, 2, 3, 4, 5, 9, 12].map(side_by_side), [1, 2, 3, 2, 3, 3, 4]);
    }

    #[test]
    fn panels_with_ranges_of_their_own_have_room_for_their_ticks() {
        let mut drawing = drawing(&["a", "b", "c", "d"], 2);
        let shared = Page::of(&drawing);
        drawing.series[1].marks = vec![Mark::Line(Stroke::Solid, vec![(0.0, 0.0), (1.0, 3e6)])];
        drawing.y.free = true;
        let page = Page::of(&drawing);
        assert_eq!(page.panel(0).y, shared.panel(0).y);
        assert_eq!((page.panel(1).y.high, page.y_ticks[1].exponent), (3.15e6, 6));
        let gap = |page: &Page| page.corner(1).0 - page.corner(0).0 - page.panel.width;
        assert!(gap(&page) >= gap(&shared) + width("0.0", SMALL));
        assert_eq!(page.corner(2).1 - page.corner(0).1, page.panel.height + GAP + NAME + POWER);
    }

    #[test]
    fn cells_are_square() {
        let cell =
            Mark::Cell { x: 0.0, y: 0.0, share: 0.0, name: String::new(), value: String::new() };
        let names = |n: usize| vec![String::new(); n];
        let mut drawing = drawing(&["a"], 0);
        drawing.series[0].marks = vec![cell];
        (drawing.x.names, drawing.y.names) = (names(5), names(5));
        let panel = Page::of(&drawing).panel;
        assert_eq!((panel.width, panel.height), (140.0, 140.0));
    }
}
