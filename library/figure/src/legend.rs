//! What the looks and the colours of a drawing stand for.

use super::drawing::{Colours, Drawing, Mark};
use super::heat::{STEPS, colour};
use super::looks::looks;
use super::marks::swatch;
use super::page::{Page, SMALL, count};
use super::render::text;
use super::text::{px, width};

const ROW: f64 = 18.0;

/// The width of the bar of colours.
const BAR: f64 = 14.0;

/// The width and height that the legend of a drawing takes to the right of panels of this height.
pub(super) fn size(drawing: &Drawing, down: f64) -> (f64, f64) {
    if let Some(Colours { label, ends: (low, high) }) = &drawing.colours {
        let widest = width(low, SMALL).max(width(high, SMALL));
        let label = if label.is_empty() { 0.0 } else { 20.0 };
        return (16.0 + BAR + 6.0 + widest + label + 8.0, bar_height(down));
    }
    let labels = drawing.labels();
    let widest = labels.iter().map(|label| width(label, SMALL)).fold(0.0, f64::max);
    let wide = if labels.is_empty() { 18.0 } else { 16.0 + 34.0 + widest + 8.0 };
    (wide, count(labels.len()) * ROW)
}

/// The legend: one entry a label, or the bar of colours.
pub(super) fn legend(drawing: &Drawing, page: &Page) -> Vec<String> {
    let (left, top) = page.corner(0);
    let (inside, down) = page.extent();
    let x = left + inside + 16.0;
    match &drawing.colours {
        Some(colours) => bar(colours, x, top, bar_height(down)),
        None => entries(drawing, x, top),
    }
}

fn entries(drawing: &Drawing, x: f64, top: f64) -> Vec<String> {
    let looks = looks(drawing);
    let mut y = top + ROW / 2.0;
    let mut out = Vec::new();
    for label in drawing.labels() {
        let alike =
            || drawing.series.iter().zip(&looks).filter(|(series, _)| series.label == *label);
        let marks: Vec<&Mark> = alike().flat_map(|(series, _)| &series.marks).collect();
        let look = alike().map(|(_, look)| *look).next().expect("labels are those of the series");
        out.extend(swatch(&marks, look, x + 12.0, y));
        out.push(text(x + 34.0, y + 4.0, SMALL, "start", label));
        y += ROW;
    }
    out
}

fn bar_height(down: f64) -> f64 {
    down.min(200.0)
}

fn bar(
    Colours { label, ends: (low, high) }: &Colours,
    x: f64,
    top: f64,
    height: f64,
) -> Vec<String> {
    let step = height / f64::from(STEPS);
    let mut out = Vec::new();
    for i in 0..STEPS {
        let share = (f64::from(i) + 0.5) / f64::from(STEPS);
        let y = top + height - f64::from(i + 1) * step;
        out.push(format!(
            r#"<rect x="{}" y="{}" width="{}" height="{}" fill="{}"/>"#,
            px(x),
            px(y),
            px(BAR),
            px(step + if i > 0 { 0.5 } else { 0.0 }),
            colour(share)
        ));
    }
    out.push(text(x + BAR + 6.0, top + 8.0, SMALL, "start", high));
    out.push(text(x + BAR + 6.0, top + height, SMALL, "start", low));
    if !label.is_empty() {
        let widest = width(low, SMALL).max(width(high, SMALL));
        let (x, y) = (px(x + BAR + 6.0 + widest + 14.0), px(top + height / 2.0));
        let turned = text(0.0, 0.0, 12.0, "middle", label);
        out.push(format!(r#"<g transform="translate({x} {y}) rotate(-90)">{turned}</g>"#));
    }
    out
}
