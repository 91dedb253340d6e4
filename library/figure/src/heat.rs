//! Colours that say how much, and cells that bear them.

use super::drawing::Mark;
use super::marks::Panel;
use super::text::{escape, px, width};

/// The colours of viridis (van der Walt and Smith, 2015) at equal distances: ever lighter, so that print without
/// colour and readers without it see the same order.
const COLOURS: [[f64; 3]; 9] = [
    [68.0, 1.0, 84.0],
    [71.0, 45.0, 123.0],
    [59.0, 82.0, 139.0],
    [44.0, 114.0, 142.0],
    [33.0, 145.0, 140.0],
    [40.0, 174.0, 128.0],
    [94.0, 201.0, 98.0],
    [173.0, 220.0, 48.0],
    [253.0, 231.0, 37.0],
];

/// So many colours a bar shows.
pub(super) const STEPS: u32 = 32;

/// The colour of a share of the way from the first to the last.
#[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "within 0 and 255")]
pub(super) fn colour(share: f64) -> String {
    let [r, g, b] = channels(share).map(|channel| channel.round() as u8);
    format!("#{r:02x}{g:02x}{b:02x}")
}

#[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "within 0 and 8")]
fn channels(share: f64) -> [f64; 3] {
    let place = share.clamp(0.0, 1.0) * 8.0;
    let below = (place as usize).min(7);
    #[expect(clippy::cast_precision_loss, reason = "at most 7")]
    let rest = place - below as f64;
    let (low, high) = (COLOURS[below], COLOURS[below + 1]);
    [0, 1, 2].map(|c| low[c] + rest * (high[c] - low[c]))
}

/// How light a colour looks, between 0 and 255 (Rec. 601).
fn lightness(share: f64) -> f64 {
    let [r, g, b] = channels(share);
    0.299 * r + 0.587 * g + 0.114 * b
}

/// Whether there is room in a cell for what it says.
pub(super) fn has_room(mark: &Mark, panel: &Panel) -> bool {
    let Mark::Cell { x, y, share, value, .. } = mark else { return true };
    let ((left, top), (right, bottom)) =
        (panel.at((x - 0.5, y + 0.5)), panel.at((x + 0.5, y - 0.5)));
    !share.is_finite() || (width(value, 10.0) < right - left - 4.0 && bottom - top > 13.0)
}

/// One cell: its colour, its value where that has room in all, and all of it in words for who asks.
pub(super) fn cell(
    (x, y): (f64, f64),
    share: f64,
    (name, value): (&str, &str),
    panel: &Panel,
) -> Vec<String> {
    let (left, top) = panel.at((x - 0.5, y + 0.5));
    let (right, bottom) = panel.at((x + 0.5, y - 0.5));
    let (wide, high) = (right - left, bottom - top);
    let fill = if share.is_finite() { colour(share) } else { "#ffffff".to_owned() };
    let mut out = vec![format!(
        r#"<rect x="{}" y="{}" width="{}" height="{}" fill="{fill}" shape-rendering="crispEdges"><title>{}: {}</title></rect>"#,
        px(left),
        px(top),
        px(wide),
        px(high),
        escape(name),
        escape(value)
    )];
    if !share.is_finite() {
        let [left, top, right, bottom] = [left + 2.0, top + 2.0, right - 2.0, bottom - 2.0].map(px);
        out.push(format!(
            r##"<path d="M{left} {top}L{right} {bottom}M{left} {bottom}L{right} {top}" stroke="#888888"/>"##
        ));
    } else if panel.valued {
        let ink = if lightness(share) > 128.0 { "#000000" } else { "#ffffff" };
        out.push(format!(
            r#"<text x="{}" y="{}" font-size="10" fill="{ink}" text-anchor="middle" pointer-events="none">{}</text>"#,
            px(f64::midpoint(left, right)),
            px(f64::midpoint(top, bottom) + 3.5),
            escape(value)
        ));
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn more_is_lighter() {
        let all: Vec<f64> = (0..=100).map(|i| lightness(f64::from(i) / 100.0)).collect();
        assert!(all.windows(2).all(|pair| pair[0] < pair[1]), "{all:?}");
        assert_eq!([colour(0.0), colour(0.5), colour(1.0)], ["#440154", "#21918c", "#fde725"]);
        assert_eq!(colour(7.0), colour(1.0));
    }
}
