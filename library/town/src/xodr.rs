//! From the text of an `OpenDRIVE` 1.4 file to a map.
//!
//! Read are plan views of lines and arcs, elevations, lane offsets, lane sections with the widths, kinds, marks and links of
//! their lanes, links of roads, and junctions (ASAM `OpenDRIVE` 1.4H, chapters 5.3 and 5.4). Signals, objects and user data
//! are passed over.

use std::collections::BTreeMap;

use roxmltree::{Document, Node, ParsingOptions};

use crate::map::{
    Connection, Cubic, End, Junction, Kind, Line, Link, Map, Mark, Piece, Road, Section, Strip,
};

/// No coordinate, length or coefficient of a road is larger: what is, is a broken file.
const LARGEST: f64 = 1e6;
/// The roads of a map have at most so many metres together.
const LONGEST: f64 = 2e5;
/// And so many square metres.
const LARGEST_AREA: f64 = 5e6;
/// A road, a piece of one or a section is at least so long, in metres.
const SHORTEST: f64 = 1e-9;
/// A road has at most so many lanes on each side.
const MOST_LANES: i32 = 64;
/// A file has at most so many elements, attributes and texts.
const MOST_NODES: u32 = 10_000_000;

/// What is wrong with a map, and where.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("line {line}: `{element}`{place} {what}")]
pub struct MapError {
    /// Line of the file, from 1.
    pub line: u32,
    /// Name of the element.
    pub element: String,
    /// Where on which road or junction it is: empty, or as in ` of road 12 at s = 3.5`.
    pub place: String,
    /// What is wrong with it.
    pub what: String,
}

/// Reads a map.
///
/// # Errors
/// Where the text is no XML or no `OpenDRIVE`, lacks what a road needs, has numbers that are none or too large, geometry other
/// than lines and arcs, or links to what is not there.
pub fn read_map(text: &str) -> Result<Map, MapError> {
    let options = ParsingOptions { nodes_limit: MOST_NODES, ..ParsingOptions::default() };
    let document = Document::parse_with_options(text, options).map_err(|why| MapError {
        line: why.pos().row,
        element: "file".to_owned(),
        place: String::new(),
        what: format!("is no XML: {why}"),
    })?;
    let root = document.root_element();
    if !root.has_tag_name("OpenDRIVE") {
        return Err(wrong(root, "is not `OpenDRIVE`"));
    }
    let (mut roads, mut junctions): (Vec<Road>, Vec<Junction>) = (Vec::new(), Vec::new());
    let (mut length, mut area) = (0.0, 0.0);
    let mut nodes = BTreeMap::new();
    for node in children(root, "road") {
        let road = road(node)?;
        if nodes.insert(road.id, node).is_some() {
            return Err(wrong(node, "is there twice"));
        }
        length += road.length;
        if length > LONGEST {
            return Err(wrong(node, &format!("is one more than {LONGEST} m of roads")));
        }
        area += crate::bounds::area(&road)
            .map_err(|(s, what)| wrong(node, &format!("{what} at s = {s}")))?;
        if area > LARGEST_AREA {
            return Err(wrong(node, &format!("is one more than {LARGEST_AREA} m² of roads")));
        }
        roads.push(road);
    }
    if roads.is_empty() {
        return Err(wrong(root, "has no `road`"));
    }
    for node in children(root, "junction") {
        let id = whole(node, "id")?;
        if junctions.iter().any(|other| other.id == id) {
            return Err(wrong(node, "is there twice"));
        }
        let connections = children(node, "connection");
        let connections = connections.map(|node| connection(node, &nodes));
        junctions.push(Junction { id, connections: connections.collect::<Result<_, _>>()? });
    }
    for road in &roads {
        let node = nodes[&road.id];
        let ends = [("predecessor", road.predecessor), ("successor", road.successor)];
        for (name, link) in ends {
            match link {
                Some(Link::Road(id, _)) if !nodes.contains_key(&id) => {
                    return Err(wrong(node, &format!("has a {name} {id}, which is no road")));
                }
                Some(Link::Junction(id)) if junctions.iter().all(|other| other.id != id) => {
                    return Err(wrong(node, &format!("has a {name} {id}, which is no junction")));
                }
                _ => {}
            }
        }
        if let Some(id) = road.junction
            && junctions.iter().all(|other| other.id != id)
        {
            return Err(wrong(node, &format!("is part of junction {id}, which is not there")));
        }
    }
    Ok(Map { roads, junctions })
}

type Read<T> = Result<T, MapError>;

fn road(node: Node) -> Read<Road> {
    let length = positive(node, "length")?;
    let junction = Some(whole(node, "junction")?).filter(|id| *id >= 0);
    let view = child(node, "planView")?;
    let plan = children(view, "geometry").map(piece).collect::<Read<Vec<Piece>>>()?;
    ascending(view, "geometry", &plan.iter().map(|piece| piece.s).collect::<Vec<_>>(), length)?;
    if let Some(last) = plan.last()
        && (last.s + last.length - length).abs() > 0.1
    {
        return Err(wrong(view, &format!("ends at {}", last.s + last.length)));
    }
    let elevation = match optional(node, "elevationProfile") {
        Some(profile) => cubics(profile, "elevation", "s")?,
        None => Vec::new(),
    };
    let lanes = child(node, "lanes")?;
    let lane_offset = cubics(lanes, "laneOffset", "s")?;
    let sections = children(lanes, "laneSection").map(section).collect::<Read<Vec<Section>>>()?;
    let starts: Vec<f64> = sections.iter().map(|section| section.s).collect();
    ascending(lanes, "laneSection", &starts, length)?;
    let links = optional(node, "link");
    let link = |name| links.and_then(|links| optional(links, name)).map(link).transpose();
    let (predecessor, successor) = (link("predecessor")?, link("successor")?);
    let id = whole(node, "id")?;
    Ok(Road {
        id,
        length,
        junction,
        plan,
        elevation,
        lane_offset,
        sections,
        predecessor,
        successor,
    })
}

/// That parts start at 0 and follow each other up to the end of the road.
fn ascending(node: Node, name: &str, starts: &[f64], length: f64) -> Read<()> {
    if starts.is_empty() {
        return Err(wrong(node, &format!("has no `{name}`")));
    }
    if starts[0].abs() > SHORTEST {
        return Err(wrong(node, &format!("has a first `{name}` at {}", starts[0])));
    }
    let ends = starts[1..].iter().chain(std::iter::once(&length));
    for (start, end) in starts.iter().zip(ends) {
        if end - start < SHORTEST {
            let what = format!("has a `{name}` at {start} of no length: what follows is at {end}");
            return Err(wrong(node, &what));
        }
    }
    Ok(())
}

fn piece(node: Node) -> Read<Piece> {
    let mut shapes = node.children().filter(Node::is_element);
    let shape = shapes.next().ok_or_else(|| wrong(node, "has no shape"))?;
    let curvature = match shape.tag_name().name() {
        "line" => 0.0,
        "arc" => number(shape, "curvature")?,
        _ => return Err(wrong(shape, "is neither `line` nor `arc`")),
    };
    Ok(Piece {
        s: number(node, "s")?,
        x: number(node, "x")?,
        y: number(node, "y")?,
        heading: number(node, "hdg")?,
        length: positive(node, "length")?,
        curvature,
    })
}

fn section(node: Node) -> Read<Section> {
    let side = |name: &str, sign: i32| -> Read<Vec<Strip>> {
        let Some(side) = optional(node, name) else { return Ok(Vec::new()) };
        let mut lanes = children(side, "lane").map(strip).collect::<Read<Vec<Strip>>>()?;
        lanes.sort_by_key(|lane| lane.id.abs());
        for (lane, i) in lanes.iter().zip(1..) {
            if lane.id != sign * i || i > MOST_LANES {
                return Err(wrong(side, &format!("has a lane {} for {}", lane.id, sign * i)));
            }
        }
        Ok(lanes)
    };
    let centre = optional(node, "center").and_then(|centre| optional(centre, "lane"));
    let centre = centre.map(marks).transpose()?.unwrap_or_default();
    Ok(Section { s: number(node, "s")?, left: side("left", 1)?, right: side("right", -1)?, centre })
}

fn strip(node: Node) -> Read<Strip> {
    let links = optional(node, "link");
    let link = |name| {
        let link = links.and_then(|links| optional(links, name));
        link.map(|link| whole(link, "id")).transpose()
    };
    let widths = cubics(node, "width", "sOffset")?;
    if widths.is_empty() {
        return Err(wrong(node, "has no `width`"));
    }
    Ok(Strip {
        id: whole(node, "id")?,
        kind: match text(node, "type")? {
            "driving" => Kind::Driving,
            "bidirectional" => Kind::Bidirectional,
            "parking" => Kind::Parking,
            "shoulder" => Kind::Shoulder,
            "sidewalk" => Kind::Sidewalk,
            "border" => Kind::Border,
            "median" => Kind::Median,
            "none" => Kind::None,
            _ => Kind::Other,
        },
        widths,
        marks: marks(node)?,
        predecessor: link("predecessor")?,
        successor: link("successor")?,
    })
}

fn marks(lane: Node) -> Read<Vec<Mark>> {
    let mark = |node| {
        let line = match text(node, "type")? {
            "none" => Line::None,
            "solid" => Line::Solid,
            "broken" => Line::Broken,
            "solid solid" => Line::SolidSolid,
            "solid broken" => Line::SolidBroken,
            "broken solid" => Line::BrokenSolid,
            "curb" => Line::Curb,
            _ => Line::Other,
        };
        Ok(Mark { s: number(node, "sOffset")?, line })
    };
    let mut marks = children(lane, "roadMark").map(mark).collect::<Read<Vec<Mark>>>()?;
    marks.sort_by(|a, b| a.s.total_cmp(&b.s));
    Ok(marks)
}

fn cubics(node: Node, name: &str, start: &str) -> Read<Vec<Cubic>> {
    let cubic = |node| {
        let of = |name| number(node, name);
        Ok(Cubic { s: of(start)?, a: of("a")?, b: of("b")?, c: of("c")?, d: of("d")? })
    };
    let mut cubics = children(node, name).map(cubic).collect::<Read<Vec<Cubic>>>()?;
    cubics.sort_by(|a, b| a.s.total_cmp(&b.s));
    Ok(cubics)
}

fn link(node: Node) -> Read<Link> {
    let id = whole(node, "elementId")?;
    match text(node, "elementType")? {
        "road" => Ok(Link::Road(id, end(node)?)),
        "junction" => Ok(Link::Junction(id)),
        other => Err(wrong(node, &format!("leads to a `{other}`"))),
    }
}

fn end(node: Node) -> Read<End> {
    match text(node, "contactPoint")? {
        "start" => Ok(End::Start),
        "end" => Ok(End::End),
        other => Err(wrong(node, &format!("has a contactPoint `{other}`"))),
    }
}

fn connection(node: Node, roads: &BTreeMap<i32, Node>) -> Read<Connection> {
    let known = |name| {
        let id = whole(node, name)?;
        let missing = || wrong(node, &format!("has a {name} {id}, which is no road"));
        roads.contains_key(&id).then_some(id).ok_or_else(missing)
    };
    let lanes =
        children(node, "laneLink").map(|link| Ok((whole(link, "from")?, whole(link, "to")?)));
    Ok(Connection {
        incoming: known("incomingRoad")?,
        connecting: known("connectingRoad")?,
        contact: end(node)?,
        lanes: lanes.collect::<Read<_>>()?,
    })
}

fn children<'a>(node: Node<'a, 'a>, name: &str) -> impl Iterator<Item = Node<'a, 'a>> {
    node.children().filter(move |child| child.has_tag_name(name))
}

fn optional<'a>(node: Node<'a, 'a>, name: &str) -> Option<Node<'a, 'a>> {
    node.children().find(|child| child.has_tag_name(name))
}

fn child<'a>(node: Node<'a, 'a>, name: &str) -> Read<Node<'a, 'a>> {
    optional(node, name).ok_or_else(|| wrong(node, &format!("has no `{name}`")))
}

fn text<'a>(node: Node<'a, 'a>, name: &str) -> Read<&'a str> {
    node.attribute(name).ok_or_else(|| wrong(node, &format!("has no `{name}`")))
}

fn whole(node: Node, name: &str) -> Read<i32> {
    let text = text(node, name)?;
    text.trim().parse().map_err(|_| wrong(node, &format!("has {name} = `{text}`, no whole number")))
}

fn number(node: Node, name: &str) -> Read<f64> {
    let text = text(node, name)?;
    let value: Option<f64> = text.trim().parse().ok();
    let value = value.ok_or_else(|| wrong(node, &format!("has {name} = `{text}`, no number")))?;
    if value.is_nan() || value.abs() > LARGEST {
        return Err(wrong(node, &format!("has {name} = {value}, beyond {LARGEST}")));
    }
    Ok(value)
}

fn positive(node: Node, name: &str) -> Read<f64> {
    let value = number(node, name)?;
    if value < SHORTEST {
        return Err(wrong(node, &format!("has {name} = {value}, not above 0")));
    }
    Ok(value)
}

fn wrong(node: Node, what: &str) -> MapError {
    let at = |name: &str| node.attribute(name).map(|s| format!(" at {name} = {s}"));
    let own = at("s").or_else(|| at("sOffset")).unwrap_or_default();
    let around =
        node.ancestors().find(|node| ["road", "junction"].contains(&node.tag_name().name()));
    let around = around.map(|node| {
        let id = node.attribute("id").unwrap_or("without id");
        format!(" of {} {id}", node.tag_name().name())
    });
    MapError {
        line: node.document().text_pos_at(node.range().start).row,
        element: node.tag_name().name().to_owned(),
        place: around.unwrap_or_default() + &own,
        what: what.to_owned(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A road of 100 m with a lane on each side.
    const SIMPLE: &str = r#"<OpenDRIVE>
<road id="7" length="100" junction="-1">
<planView><geometry s="0" x="1" y="2" hdg="0" length="100"><line/></geometry></planView>
<lanes><laneSection s="0">
<left><lane id="1" type="driving"><width sOffset="0" a="3" b="0" c="0" d="0"/></lane></left>
<center><lane id="0" type="none"><roadMark sOffset="0" type="broken"/></lane></center>
<right><lane id="-1" type="driving"><width sOffset="0" a="4" b="0" c="0" d="0"/></lane></right>
</laneSection></lanes>
</road>
</OpenDRIVE>"#;

    fn check(from: &str, to: &str, expected: &str) {
        assert!(SIMPLE.contains(from), "{from}");
        let error = read_map(&SIMPLE.replace(from, to)).expect_err(to).to_string();
        assert!(error.contains(expected), "`{error}` has no `{expected}`");
    }

    #[test]
    fn a_road_is_read() {
        let map = read_map(SIMPLE).unwrap();
        let road = &map.roads[0];
        assert_eq!((road.id, road.length, road.junction), (7, 100.0, None));
        assert_eq!(road.plan[0].x, 1.0);
        let section = &road.sections[0];
        assert_eq!((section.left[0].widths[0].a, section.right[0].widths[0].a), (3.0, 4.0));
        assert_eq!((section.right[0].id, section.right[0].kind), (-1, Kind::Driving));
        assert_eq!(section.centre, [Mark { s: 0.0, line: Line::Broken }]);
    }

    #[test]
    fn what_is_wrong_is_named_with_its_place() {
        check("y=\"2\" ", "", "line 3: `geometry` of road 7 at s = 0 has no `y`");
        check(
            "length=\"100\" junction",
            "length=\"1e300\" junction",
            "line 2: `road` of road 7 has length",
        );
        check("x=\"1\"", "x=\"NaN\"", "beyond 1000000");
        check("x=\"1\"", "x=\"inf\"", "beyond");
        check(
            "a=\"4\"",
            "a=\"wide\"",
            "line 7: `width` of road 7 at sOffset = 0 has a = `wide`, no number",
        );
        check("length=\"100\" junction", "length=\"-3\" junction", "not above 0");
        check("length=\"100\" junction", "length=\"90\" junction", "ends at 100");
        check(
            "<line/>",
            "<spiral curvStart=\"0\" curvEnd=\"1\"/>",
            "line 3: `spiral` of road 7 is neither",
        );
        check("<line/>", "", "has no shape");
        check("<line/>", "<arc/>", "`arc` of road 7 has no `curvature`");
        check("id=\"-1\"", "id=\"-2\"", "line 7: `right` of road 7 has a lane -2 for -1");
        check("<laneSection s=\"0\">", "<laneSection s=\"50\">", "first `laneSection` at 50");
        check("id=\"7\"", "id=\"seven\"", "no whole number");
        check("junction=\"-1\"", "junction=\"5\"", "is part of junction 5");
        check(
            "<lanes>",
            "<link><successor elementType=\"road\" elementId=\"8\" contactPoint=\"start\"/></link><lanes>",
            "has a successor 8, which is no road",
        );
        check(
            "<lanes>",
            "<link><successor elementType=\"road\" elementId=\"7\" contactPoint=\"middle\"/></link><lanes>",
            "contactPoint `middle`",
        );
        check(
            "</road>",
            "</road><junction id=\"3\"><connection incomingRoad=\"7\" connectingRoad=\"9\" contactPoint=\"start\"/></junction>",
            "of junction 3 has a connectingRoad 9",
        );
        check("</road>", "</rod>", "is no XML");
        check("OpenDRIVE", "OpenSCENARIO", "is not `OpenDRIVE`");
        let twice = SIMPLE.replace("</OpenDRIVE>", &SIMPLE[11..]);
        assert!(
            read_map(&twice)
                .unwrap_err()
                .to_string()
                .contains("line 11: `road` of road 7 is there twice")
        );
    }

    #[test]
    fn roads_that_no_town_has_are_none() {
        check("a=\"4\"", "a=\"400\"", "line 2: `road` of road 7 has a lane -1 of 400 m at s = 0");
        check("a=\"4\"", "a=\"-4\"", "has a lane -1 of -4 m");
        check("a=\"4\" b=\"0\" c=\"0\"", "a=\"4\" b=\"3\" c=\"0\"", "of 202 m at s = 66");
        check("a=\"4\" b=\"0\" c=\"0\"", "a=\"4\" b=\"0\" c=\"-99\"", "changes too fast");
        let high = "<elevationProfile><elevation s=\"0\" a=\"99999\" b=\"0\" c=\"0\" d=\"0\"/></elevationProfile><lanes>";
        check("<lanes>", high, "is at a height of 99999 m at s = 0");
        check(
            "<lanes>",
            "<lanes><laneOffset s=\"0\" a=\"199\" b=\"0\" c=\"0\" d=\"0\"/>",
            "is wider than 200 m",
        );
        let long = SIMPLE.replace("length=\"100\"", "length=\"900000\"");
        assert!(read_map(&long).unwrap_err().to_string().contains("more than 200000 m of roads"));
    }

    #[test]
    fn no_text_is_too_strange() {
        let depth = 200_000;
        let deep =
            format!("<OpenDRIVE>{}{}</OpenDRIVE>", "<a>".repeat(depth), "</a>".repeat(depth));
        for text in ["", "<", "\u{0}", "<OpenDRIVE/>", "<OpenDRIVE><road/></OpenDRIVE>", &deep] {
            assert!(read_map(text).is_err(), "{}", &text[..text.len().min(30)]);
        }
        let bomb =
            r#"<!DOCTYPE a [<!ENTITY b "x"><!ENTITY c "&b;&b;">]><OpenDRIVE>&c;</OpenDRIVE>"#;
        assert!(read_map(bomb).is_err());
        // Cut anywhere, it is an error and no panic.
        for end in (0..SIMPLE.len()).filter(|end| SIMPLE.is_char_boundary(*end)) {
            assert!(read_map(&SIMPLE[..end]).is_err());
        }
    }
}
