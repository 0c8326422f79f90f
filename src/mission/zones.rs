//! Where a mission wants the base to drive slowly.

use std::sync::Arc;

use super::fields::POINT;
use super::solids;
use crate::diag::shape::{Bounds, Field, Shape};
use crate::diag::yaml::Node;
use crate::diag::{Diagnostic, Source, Span};

/// An area in which the base goes slower than elsewhere.
#[derive(Debug, Clone, PartialEq)]
pub struct SpeedZone {
    /// Corners in order, either way round, m; the last joins the first. What it winds around belongs to it, and so does its edge.
    pub polygon: Vec<[f64; 2]>,
    /// Greatest speed of the base frame's origin there (the middle between the driving wheels), m/s.
    pub speed: f64,
}

pub(super) static ZONE: Shape = Shape::Table(&ZONE_FIELDS);

static ZONE_FIELDS: [Field; 2] = [
    Field::required(
        "polygon_m",
        Shape::List { item: &POINT, count: (3, 1000), form: "a list of 3 to 1000 corners [x, y] in metres" },
        "[[2, 1], [3, 1], [3, 2]]",
        "corners [x, y] in order, metres; the last joins the first",
    ),
    Field::required(
        "speed_mps",
        Shape::Number(Bounds::between(0.001, 1000.0, "m/s")),
        "0.3",
        "greatest speed while the middle between the driving wheels is in the polygon, m/s",
    ),
];

fn polygon(node: &Node) -> Option<Vec<[f64; 2]>> {
    node.get("polygon_m")?.items().iter().map(super::read::numbers).collect()
}

fn items(map: &Node) -> &[Node] {
    map.get("speed_zones").map_or(&[], Node::items)
}

/// `map.speed_zones` of a checked tree.
pub(super) fn zones(map: &Node) -> Vec<SpeedZone> {
    let read = |node: &Node| Some(SpeedZone { polygon: polygon(node)?, speed: node.get("speed_mps")?.number()? });
    items(map).iter().filter_map(read).collect()
}

/// Polygons without an area.
pub(super) fn check(source: &Arc<Source>, map: &Node) -> Vec<Diagnostic> {
    let flat = items(map)
        .iter()
        .enumerate()
        .filter(|(_, node)| polygon(node).is_some_and(|polygon| polygon.len() >= 3 && !solids::has_an_area(&polygon)));
    let crossed = items(map).iter().enumerate().filter_map(|(i, node)| {
        let [one, other] = polygon(node).filter(|p| solids::has_an_area(p)).and_then(|p| solids::crossing(&p))?;
        let message = format!("`map.speed_zones[{i}].polygon_m` crosses itself: its sides {one} and {other} cross");
        let at = node.get("polygon_m").unwrap_or(node).range.clone();
        Some(Diagnostic::error("mission/speed-zone", message).at(&Span::new(source, at)).hint(solids::CROSSED))
    });
    let fault = |(i, node): (usize, &Node)| {
        let message = format!("`map.speed_zones[{i}].polygon_m` has no area: it is thinner than 1 mm");
        Diagnostic::error("mission/speed-zone", message)
            .at(&Span::new(source, node.range.clone()))
            .hint("name the corners of an area in their order, such as `[[2, 1], [3, 1], [3, 2]]`")
    };
    flat.map(fault).chain(crossed).collect()
}
