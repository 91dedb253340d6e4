//! Files that are broken somewhere: an error, or a town in which one can drive or not, but never a panic or no end.

use ivx_town::{Body, Lidar, Pose, drive, picture, read_map, scan, town, traffic};

fn drawn(mut state: u64) -> impl FnMut() -> f64 {
    move || {
        state =
            state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        f64::from(u32::try_from(state >> 32).expect("it has 32 bits")) / 4_294_967_296.0
    }
}

/// Two roads that lead around and around, and a junction through which one could go.
fn small() -> String {
    let strip = |id: i32, kind: &str| {
        format!(
            r#"<lane id="{id}" type="{kind}"><link><predecessor id="{id}"/><successor id="{id}"/></link>
            <width sOffset="0" a="3.5" b="0" c="0" d="0"/><roadMark sOffset="0" type="broken"/></lane>"#
        )
    };
    let road = |id: i32, y: f64, heading: f64, next: i32| {
        format!(
            r#"<road id="{id}" length="62.8" junction="-1"><link>
            <predecessor elementType="road" elementId="{next}" contactPoint="end"/>
            <successor elementType="road" elementId="{next}" contactPoint="start"/></link>
            <planView><geometry s="0" x="0" y="{y}" hdg="{heading}" length="62.8"><arc curvature="0.05"/></geometry></planView>
            <elevationProfile><elevation s="0" a="1" b="0.01" c="0" d="0"/></elevationProfile>
            <lanes><laneOffset s="0" a="0" b="0" c="0" d="0"/><laneSection s="0">
            <left>{}{}</left><center><lane id="0" type="none"/></center><right>{}{}</right></laneSection></lanes></road>"#,
            strip(2, "sidewalk"),
            strip(1, "driving"),
            strip(-1, "driving"),
            strip(-2, "shoulder"),
        )
    };
    format!(
        r#"<OpenDRIVE>{}{}<junction id="9"><connection id="0" incomingRoad="1" connectingRoad="2" contactPoint="start">
        <laneLink from="-1" to="-1"/></connection></junction></OpenDRIVE>"#,
        road(1, -20.0, 0.0, 2),
        road(2, 20.0, std::f64::consts::PI, 1),
    )
}

/// Makes a town of a text and drives in it; whether it is one.
fn try_to_drive(text: &str) -> bool {
    let Ok(map) = read_map(text) else { return false };
    let town = town(map);
    let mut draw = drawn(1);
    let mut cars = traffic(&town.space, &town.centres, 5, &[], &mut draw);
    (0..20).for_each(|_| cars.step(&town.space, &town.centres, &mut draw));
    let _ = town.network.topology();
    for lane in 0..town.network.lanes.len() {
        let _ = town.network.ahead(town.network.start(lane), 500.0);
    }
    let [from, to] = [Pose { y: 18.0, ..Pose::default() }, Pose { y: -18.0, ..Pose::default() }];
    let bodies: Vec<Body> = cars.bodies().collect();
    let _ = picture(&scan(&Lidar::default(), &town.relief, &from, &bodies), -2.4);
    if let Ok(mut drive) = drive(&town, &from, &to, 3, &mut draw) {
        for _ in 0..20 {
            drive.step(&town, &ivx_town::Controls::default(), &mut draw);
        }
    }
    true
}

#[test]
fn whatever_is_changed_it_ends() {
    let text = small();
    assert!(try_to_drive(&text));
    let mut n_towns = 0;
    let mut n = 0;
    let values: Vec<(usize, usize)> = text
        .match_indices('"')
        .map(|(at, _)| at)
        .collect::<Vec<usize>>()
        .chunks_exact(2)
        .map(|pair| (pair[0] + 1, pair[1]))
        .collect();
    for (from, to) in values {
        for value in ["NaN", "-1", "1", "2", "1e-9", "1e5", "end"] {
            let changed = format!("{}{value}{}", &text[..from], &text[to..]);
            n += 1;
            n_towns += usize::from(try_to_drive(&changed));
        }
    }
    // Some can be driven in, and some cannot.
    assert!(n_towns > n / 10 && n_towns < n, "{n_towns} of {n}");
}

#[test]
fn whatever_is_missing_it_ends() {
    let text = small();
    for (from, _) in text.match_indices('<') {
        let to = text[from..].find('>').map_or(text.len(), |length| from + length + 1);
        let _ = try_to_drive(&format!("{}{}", &text[..from], &text[to..]));
    }
    let attributes = text.match_indices("=\"").map(|(at, _)| at);
    for at in attributes {
        let from = text[..at].rfind(' ').expect("a name is before it");
        let to = at + 2 + text[at + 2..].find('"').expect("it is closed") + 1;
        let _ = try_to_drive(&format!("{}{}", &text[..from], &text[to..]));
    }
}
