//! Pictures that may stand in a page as they are.

/// What our own drawings are made of.
const ELEMENTS: [&str; 8] = ["svg", "rect", "path", "polyline", "polygon", "circle", "text", "g"];

/// Their attributes.
const ATTRIBUTES: [&str; 35] = [
    "xmlns",
    "width",
    "height",
    "viewBox",
    "font-family",
    "role",
    "x",
    "y",
    "d",
    "points",
    "cx",
    "cy",
    "r",
    "fill",
    "fill-opacity",
    "stroke",
    "stroke-width",
    "stroke-opacity",
    "stroke-dasharray",
    "stroke-linejoin",
    "stroke-linecap",
    "font-size",
    "font-weight",
    "text-anchor",
    "transform",
    "shape-rendering",
    "pointer-events",
    "rx",
    "ry",
    "x1",
    "x2",
    "y1",
    "y2",
    "dx",
    "dy",
];

/// Whether a picture is made of nothing but shapes and text, each closed in its turn, so that it can do nothing
/// and ends where it should.
pub(super) fn is_plain(svg: &str) -> bool {
    let Some(rest) = svg.trim_start().strip_prefix('<') else { return false };
    let mut open: Vec<&str> = Vec::new();
    for (i, piece) in rest.split('<').enumerate() {
        // Nothing comes behind the picture.
        if i > 0 && open.is_empty() {
            return false;
        }
        let Some((tag, _)) = piece.split_once('>') else { return false };
        if let Some(name) = tag.strip_prefix('/') {
            if open.pop() != Some(name) {
                return false;
            }
            continue;
        }
        let (tag, is_empty) = tag.strip_suffix('/').map_or((tag, false), |tag| (tag, true));
        let (name, attributes) = tag.split_once(' ').unwrap_or((tag, ""));
        let known = ELEMENTS.contains(&name) || name == "title";
        if !known || (i == 0 && name != "svg") || !are_plain(attributes) {
            return false;
        }
        if !is_empty {
            open.push(name);
        }
    }
    open.is_empty()
}

/// Whether these are attributes of drawings, `name="value"` each.
fn are_plain(attributes: &str) -> bool {
    let mut rest = attributes.trim();
    while !rest.is_empty() {
        let Some((name, after)) = rest.split_once("=\"") else { return false };
        let Some((value, after)) = after.split_once('"') else { return false };
        if !ATTRIBUTES.contains(&name)
            || value.contains("url")
            || value.contains(':') && name != "xmlns"
        {
            return false;
        }
        rest = after.trim_start();
    }
    true
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shapes_and_text_are_plain() {
        assert!(is_plain(
            "<svg width=\"1\" xmlns=\"http://www.w3.org/2000/svg\"><text x=\"1\">a &lt;</text><rect/></svg>\n"
        ));
        assert!(is_plain("<svg><svg><rect fill=\"#fff\"><title>1</title></rect></svg></svg>"));
    }

    #[test]
    fn what_could_act_or_reach_out_is_not() {
        for bad in [
            "",
            "text",
            "<p></p>",
            "<svg>",
            "<svg></svg><p></p>",
            "<svg></p></svg>",
            "<svg><script>x</script></svg>",
            "<svg onload=\"x\"></svg>",
            "<svg><a href=\"x\"></a></svg>",
            "<svg><rect fill=\"url(http://x)\"/></svg>",
            "<svg><rect fill='x'/></svg>",
            "<svg><style></style></svg>",
            "<svg><!-- --></svg>",
            "<svg><rect x=\"1\" onclick=\"y\"/></svg>",
        ] {
            assert!(!is_plain(bad), "{bad}");
        }
    }
}
