//! What a mission adds to its map: keep-out areas and boxes.

use std::sync::Arc;

use super::fields::{METRES, POINT, POINT_IN_SPACE};
use crate::diag::shape::{Field, Shape};
use crate::diag::yaml::Node;
use crate::diag::{Diagnostic, Source, Span};
use crate::geom::Aabb;
use crate::math::real;

/// Thinner than this is a slip of the pen, m.
const THINNEST: f64 = 1e-3;

/// An area that the robot must keep out of: a prism over a polygon.
#[derive(Debug, Clone, PartialEq)]
pub struct KeepOut {
    /// Corners in order, either way round, m; the last joins the first. What it winds around belongs to it.
    pub polygon: Vec<[f64; 2]>,
    /// From and to, m. Without it: from the floor to the top of the robot.
    pub height: Option<[f64; 2]>,
}

pub(super) static KEEP_OUT: Shape = Shape::Table(&KEEP_OUT_FIELDS);
pub(super) static BOX: Shape = Shape::Table(&BOX_FIELDS);

static KEEP_OUT_FIELDS: [Field; 2] = [
    Field::required(
        "polygon_m",
        Shape::List { item: &POINT, count: (3, 1000), form: "a list of 3 to 1000 corners [x, y] in metres" },
        "[[2, 1], [3, 1], [3, 2]]",
        "corners [x, y] in order, metres; the last joins the first",
    ),
    Field::optional(
        "height_m",
        Shape::List { item: &METRES, count: (2, 2), form: "[from, to] in metres: 2 numbers" },
        "[0, 0.5]",
        "from which height to which, metres; default: the robot's whole height",
    ),
];

static BOX_FIELDS: [Field; 2] = [
    Field::required("min_m", POINT_IN_SPACE, "[2, 1, 0]", "the corner with the least x, y and z, metres"),
    Field::required("max_m", POINT_IN_SPACE, "[3, 2, 0.5]", "the opposite corner, metres"),
];

/// What to do about a polygon that crosses itself.
pub(super) const CROSSED: &str = "name the corners in their order around the area; two areas are two polygons";

fn items<'a>(map: &'a Node, key: &str) -> &'a [Node] {
    map.get(key).map_or(&[], Node::items)
}

fn polygon(node: &Node) -> Option<Vec<[f64; 2]>> {
    node.get("polygon_m")?.items().iter().map(super::read::numbers).collect()
}

fn aabb(node: &Node) -> Option<Aabb> {
    let corner = |key: &str| node.get(key).and_then(super::read::numbers);
    Some(Aabb { min: corner("min_m")?, max: corner("max_m")? })
}

/// `map.keep_out` of a checked tree.
pub(super) fn keep_outs(map: &Node) -> Vec<KeepOut> {
    let height = |node: &Node| node.get("height_m").and_then(super::read::numbers);
    let read = |node| Some(KeepOut { polygon: polygon(node)?, height: height(node) });
    items(map, "keep_out").iter().filter_map(read).collect()
}

/// `map.boxes` of a checked tree.
pub(super) fn boxes(map: &Node) -> Vec<Aabb> {
    items(map, "boxes").iter().filter_map(aabb).collect()
}

/// Polygons without an area, heights and boxes that are upside down.
pub(super) fn check(source: &Arc<Source>, map: &Node) -> Vec<Diagnostic> {
    let mut faults = Vec::new();
    let mut fault = |code, message: String, node: &Node, hint: &str| {
        faults.push(Diagnostic::error(code, message).at(&Span::new(source, node.range.clone())).hint(hint));
    };
    for (i, node) in items(map, "keep_out").iter().enumerate() {
        if let Some(polygon) = polygon(node).filter(|polygon| polygon.len() >= 3)
            && !has_an_area(&polygon)
        {
            let message = format!("`map.keep_out[{i}].polygon_m` has no area: it is thinner than 1 mm");
            fault(
                "mission/keep-out",
                message,
                node,
                "name the corners of an area in their order, such as `[[2, 1], [3, 1], [3, 2]]`",
            );
        }
        if let Some([one, other]) = polygon(node).filter(|p| has_an_area(p)).and_then(|p| crossing(&p)) {
            let message = format!("`map.keep_out[{i}].polygon_m` crosses itself: its sides {one} and {other} cross");
            fault("mission/keep-out", message, node.get("polygon_m").unwrap_or(node), CROSSED);
        }
        if let Some([low, high]) = node.get("height_m").and_then(super::read::numbers)
            && high - low < THINNEST
        {
            let message = format!("`map.keep_out[{i}].height_m`: {low} m is not 1 mm below {high} m");
            fault(
                "mission/keep-out",
                message,
                node,
                "write [from, to], such as `[0, 0.5]`, or leave it out: the whole height",
            );
        }
    }
    for (i, node) in items(map, "boxes").iter().enumerate() {
        let Some(solid) = aabb(node) else { continue };
        if let Some(axis) = (0..3).find(|a| solid.max[*a] - solid.min[*a] < THINNEST) {
            let (low, high) = (solid.min[axis], solid.max[axis]);
            let message =
                format!("`map.boxes[{i}]`: its {} goes from {low} to {high} m, less than 1 mm", ["x", "y", "z"][axis]);
            fault("mission/box", message, node, "`min_m` holds the least x, y and z, `max_m` the greatest");
        }
    }
    faults
}

/// The first two sides of a polygon, from 1, that cross each other. Sides that only touch are let pass, such as those of a list
/// that repeats its first corner at its end.
pub(super) fn crossing(polygon: &[[f64; 2]]) -> Option<[usize; 2]> {
    let n = polygon.len();
    let side = |i: usize| [polygon[i], polygon[(i + 1) % n]];
    // Above 0 where a point lies left of a -> b.
    let left = |[a, b]: [[f64; 2]; 2], p: [f64; 2]| (b[0] - a[0]) * (p[1] - a[1]) - (b[1] - a[1]) * (p[0] - a[0]);
    let parts = |one, [p, q]: [[f64; 2]; 2]| {
        let (p, q) = (left(one, p), left(one, q));
        p < 0.0 && q > 0.0 || p > 0.0 && q < 0.0
    };
    let mut pairs = (0..n).flat_map(|i| (i + 2..n).map(move |j| [i, j]));
    let found = pairs.find(|[i, j]| parts(side(*i), side(*j)) && parts(side(*j), side(*i)));
    found.map(|[i, j]| [i + 1, j + 1])
}

/// Whether a polygon is at least 1 mm wide across each of its sides.
pub(super) fn has_an_area(polygon: &[[f64; 2]]) -> bool {
    let next = polygon.iter().cycle().skip(1);
    let widths = polygon.iter().zip(next).filter_map(|(a, b)| {
        let (dx, dy) = (b[0] - a[0], b[1] - a[1]);
        let length = real::hypot(dx, dy);
        let off = polygon.iter().map(|p| ((p[1] - a[1]) * dx - (p[0] - a[0]) * dy) / length);
        let (low, high) = off.fold((0.0f64, 0.0f64), |(low, high), d| (low.min(d), high.max(d)));
        (length > 0.0).then_some(high - low)
    });
    widths.reduce(f64::min).is_some_and(|width| width >= THINNEST)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_bow_tie_crosses_itself_and_a_closed_ring_does_not() {
        assert_eq!(crossing(&[[0.0, 0.0], [1.0, 1.0], [1.0, 0.0], [0.0, 1.0]]), Some([1, 3]));
        for ring in [
            vec![[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 0.0]],
            vec![[0.0, 0.0], [2.0, 0.0], [2.0, 2.0], [1.0, 0.5], [0.0, 2.0]],
            vec![[0.0, 0.0], [1.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]],
        ] {
            assert_eq!(crossing(&ring), None, "{ring:?}");
        }
    }
}
