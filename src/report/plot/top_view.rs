//! The top view: obstacles, path, the robot's outline on its way.

use super::chart::{BOTTOM, LEFT, RIGHT, SMALL, axes};
use super::outline::{self, Part};
use super::scale::Scale;
use super::svg::{Anchor, Area, COLOURS, GREY, INK, Lettering, Paint, Svg, text_width};
use crate::geom::{Aabb, Pose2};
use crate::map::VoxelMap;
use crate::math::real;
use crate::robot::RobotModel;

/// What stands on the floor.
const OBSTACLE: &str = "#7b828c";
/// What the robot can pass under.
const OVERHEAD: &str = "#c9cfd8";
/// Quarters of a map's height, from the lowest.
const SHADES: [&str; 4] = ["#c3cbd6", "#96a0ae", "#66707e", "#363d47"];
/// Room above for the legend, px.
const TOP: f64 = 26.0;
/// A view is no higher than this, px, unless it is wider than that too.
const HIGHEST: f64 = 720.0;

/// A view of the floor from above, to scale, x to the right.
#[derive(Debug, Clone, PartialEq)]
pub struct TopView {
    low: [f64; 2],
    high: [f64; 2],
    items: Vec<Item>,
    /// Legend: paint and text, each once.
    legend: Vec<(Paint, String)>,
}

#[derive(Debug, Clone, PartialEq)]
enum Item {
    Outlines(Vec<Vec<[f64; 2]>>, Paint),
    Line(Vec<[f64; 2]>, Paint),
    Note([f64; 2], String),
    Ring([f64; 2]),
}

impl TopView {
    /// An empty view of these bounds' x and y, m.
    pub fn new(bounds: Aabb) -> Self {
        let [low, high] = [bounds.min, bounds.max].map(|p| [p[0], p[1]]);
        Self { low, high, items: Vec::new(), legend: Vec::new() }
    }

    /// A view that holds all `points`, m, and `margin` around them.
    pub fn around(points: impl Iterator<Item = [f64; 2]>, margin: f64) -> Self {
        let start = ([f64::INFINITY; 2], [f64::NEG_INFINITY; 2]);
        let wider = |(low, high): ([f64; 2], [f64; 2]), p: [f64; 2]| {
            ([0, 1].map(|a| low[a].min(p[a])), [0, 1].map(|a| high[a].max(p[a])))
        };
        let (low, high) = points.filter(|p| p.iter().all(|v| v.is_finite())).fold(start, wider);
        let (low, high) = if low[0] > high[0] { ([0.0; 2], [1.0; 2]) } else { (low, high) };
        let (min, max) = ([low[0] - margin, low[1] - margin, 0.0], [high[0] + margin, high[1] + margin, 0.0]);
        Self::new(Aabb { min, max })
    }

    /// A view of a map. Columns whose lowest obstacle begins at `under` or higher (m) are light: passed under.
    pub fn of_map(map: &VoxelMap, under: f64) -> Self {
        let mut view = Self::new(map.bounds());
        let dims = [map.dims[0], map.dims[1]];
        let lowest = |i: usize, j: usize| {
            let words = map.column(i, j);
            let word = words.iter().position(|w| *w != 0)?;
            Some(map.origin[2] + map.resolution * (64 * word + words[word].trailing_zeros() as usize) as f64)
        };
        for (name, colour, overhead) in [("overhead", OVERHEAD, true), ("obstacle", OBSTACLE, false)] {
            let of_kind = |z: f64| (z >= under - 1e-9) == overhead;
            if (0..dims[0]).any(|i| (0..dims[1]).any(|j| lowest(i, j).is_some_and(of_kind))) {
                view.cells(map, |i, j| lowest(i, j).is_some_and(of_kind), colour, name.to_owned());
            }
        }
        view
    }

    /// A view of a map, columns by how high their highest obstacle reaches in the grid: the darker, the higher.
    pub fn by_height(map: &VoxelMap) -> Self {
        let mut view = Self::new(map.bounds());
        let part = |i: usize, j: usize| {
            let words = map.column(i, j);
            let word = words.iter().rposition(|w| *w != 0)?;
            let highest = 64 * word + 63 - words[word].leading_zeros() as usize;
            Some(highest * SHADES.len() / map.dims[2])
        };
        for (shade, colour) in SHADES.iter().enumerate() {
            let reach = map.dims[2] * (shade + 1) / SHADES.len();
            let top = map.origin[2] + map.resolution * reach as f64;
            view.cells(map, |i, j| part(i, j) == Some(shade), colour, format!("up to z {top:.2} m"));
        }
        view
    }

    /// A view of one layer of a map's cells.
    pub fn slice(map: &VoxelMap, layer: usize) -> Self {
        let mut view = Self::new(map.bounds());
        let z = map.origin[2] + map.resolution * (layer as f64 + 0.5);
        view.cells(map, |i, j| map.occupied([i, j, layer]), OBSTACLE, format!("slice at z {z:.2} m"));
        view
    }

    fn cells(&mut self, map: &VoxelMap, inside: impl Fn(usize, usize) -> bool, colour: &'static str, name: String) {
        let metres = |c: [usize; 2]| [0, 1].map(|a| map.origin[a] + map.resolution * c[a] as f64);
        let loops = outline::of_cells([map.dims[0], map.dims[1]], inside);
        let loops = loops.into_iter().map(|l| l.into_iter().map(metres).collect()).collect();
        self.add(Item::Outlines(loops, Paint::fill(colour)), Paint::fill(colour), name);
    }

    /// The path of the base frame's origin through these points.
    pub fn path(&mut self, points: Vec<[f64; 2]>, name: &'static str) {
        let paint = Paint::line(INK, 1.8);
        self.add(Item::Line(points, paint), paint, name);
    }

    /// A region that these outlines cover together, tinted, in the colour of this index.
    pub fn region(&mut self, loops: Vec<Vec<[f64; 2]>>, colour: usize, name: &'static str) {
        let colour = COLOURS[colour % COLOURS.len()];
        let paint = Paint::line(colour, 0.5).tinted(colour, 0.12);
        for outline in loops {
            self.add(Item::Outlines(vec![outline], paint), paint, name);
        }
    }

    /// How many points it is drawn from.
    pub fn size(&self) -> usize {
        let points = |item: &Item| match item {
            Item::Outlines(loops, _) => loops.iter().map(Vec::len).sum(),
            Item::Line(points, _) => points.len(),
            Item::Note(..) | Item::Ring(_) => 1,
        };
        self.items.iter().map(points).sum()
    }

    /// Another way through these points, dashed, in the colour of this index.
    pub fn trace(&mut self, points: Vec<[f64; 2]>, colour: usize, name: &'static str) {
        let paint = Paint::line(COLOURS[colour % COLOURS.len()], 1.8).dashed(["7 3", "2 2"][colour % 2]);
        self.add(Item::Line(points, paint), paint, name);
    }

    /// An area of the floor, outlined and faintly tinted.
    pub fn area(&mut self, corners: Vec<[f64; 2]>, colour: usize, name: &'static str) {
        let colour = COLOURS[colour % COLOURS.len()];
        let paint = Paint::line(colour, 1.2).tinted(colour, 0.10).dashed("5 3");
        self.add(Item::Outlines(vec![corners], paint), paint, name);
    }

    /// The robot's outline at a pose with joint values `q`: base and what joints move in two colours.
    pub fn robot(&mut self, robot: &RobotModel, pose: Pose2, q: &[f64]) {
        for Part { outline, fixed } in outline::of_robot(robot, pose, q) {
            let (colour, opacity, name) =
                if fixed { (COLOURS[0], 0.10, "base") } else { (COLOURS[1], 0.22, "moved by joints") };
            let paint = Paint::line(colour, 0.8).tinted(colour, opacity);
            self.add(Item::Outlines(vec![outline], paint), paint, name);
        }
    }

    /// The robot's outline at an end of the way, drawn strongly, with an arrow ahead and a name.
    pub fn end(&mut self, robot: &RobotModel, pose: Pose2, q: &[f64], name: &str) {
        let parts = outline::of_robot(robot, pose, q);
        let reach = parts
            .iter()
            .flat_map(|p| &p.outline)
            .map(|p| real::hypot(p[0] - pose.x, p[1] - pose.y))
            .fold(0.1, f64::max);
        let paint = Paint::line(INK, 1.6);
        self.items.extend(parts.into_iter().map(|p| Item::Outlines(vec![p.outline], paint)));
        let ahead = |d: f64, side: f64| {
            let (sin, cos) = real::sin_cos(pose.yaw);
            [pose.x + d * cos - side * sin, pose.y + d * sin + side * cos]
        };
        let head = [ahead(0.45 * reach, 0.0), ahead(0.2 * reach, 0.14 * reach), ahead(0.2 * reach, -0.14 * reach)];
        self.items.push(Item::Outlines(vec![head.to_vec()], Paint::fill(INK)));
        self.items.push(Item::Line(vec![ahead(-0.2 * reach, 0.0), ahead(0.2 * reach, 0.0)], paint));
        self.items.push(Item::Note([pose.x, pose.y - reach], name.to_owned()));
    }

    /// A text on the floor, m; its middle is there.
    pub fn note(&mut self, at: [f64; 2], text: impl Into<String>) {
        self.items.push(Item::Note(at, text.into()));
    }

    /// A ring that draws the eye, with a text to its right.
    pub fn mark(&mut self, at: [f64; 2], text: impl Into<String>) {
        self.items.push(Item::Ring(at));
        self.items.push(Item::Note(at, text.into()));
    }

    fn add(&mut self, item: Item, paint: Paint, name: impl Into<String>) {
        self.items.push(item);
        let name = name.into();
        if !self.legend.iter().any(|(_, known)| *known == name) {
            self.legend.push((paint, name));
        }
    }

    /// Height that it takes at a width, px.
    pub fn height(&self, width: f64) -> f64 {
        let inner = width - LEFT - RIGHT;
        let [w, h] = [0, 1].map(|a| self.high[a] - self.low[a]);
        (inner * h / w).min(HIGHEST.max(0.6 * width)) + TOP + BOTTOM
    }

    /// Draws it into an area, as large as fits.
    pub fn draw(&self, svg: &mut Svg, area: Area) {
        let room = area.inside(LEFT, TOP, RIGHT, BOTTOM);
        let size = [0, 1].map(|a| self.high[a] - self.low[a]);
        let scale = (room.width / size[0]).min(room.height / size[1]);
        let (width, height) = (scale * size[0], scale * size[1]);
        let inner = Area { x: room.x + 0.5 * (room.width - width), width, height, ..room };
        let [x, y] = [0, 1].map(|a| Scale::exactly(self.low[a], self.high[a]));
        axes(svg, inner, [&x, &y], ["x m", "y m"]);
        let place =
            |p: [f64; 2]| [inner.x + scale * (p[0] - self.low[0]), inner.bottom() - scale * (p[1] - self.low[1])];
        let placed = |points: &[[f64; 2]]| -> Vec<[f64; 2]> { points.iter().copied().map(place).collect() };
        svg.within(inner, |svg| {
            for item in &self.items {
                match item {
                    Item::Outlines(loops, paint) => {
                        svg.outlines(&loops.iter().map(|l| placed(l)).collect::<Vec<_>>(), paint);
                    }
                    Item::Line(points, paint) => svg.polyline(&placed(points), paint),
                    Item::Ring(at) => svg.circle(place(*at), 11.0, &Paint::line(COLOURS[1], 2.2)),
                    Item::Note(..) => {}
                }
            }
        });
        svg.rectangle(inner, &Paint::line(INK, 1.0));
        self.notes(svg, inner, place);
        self.legend(svg, inner);
    }

    /// Notes are drawn last, kept within the frame and off each other where a small shift does.
    fn notes(&self, svg: &mut Svg, inner: Area, place: impl Fn([f64; 2]) -> [f64; 2]) {
        let mut taken: Vec<[f64; 4]> = Vec::new();
        let mut ringed = false;
        for item in &self.items {
            let Item::Note(at, text) = item else {
                ringed = matches!(item, Item::Ring(_));
                continue;
            };
            let half = 0.5 * text_width(text, SMALL);
            let [x, y] = place(*at);
            let x = if ringed { x + 15.0 + half } else { x };
            ringed = false;
            let x = x.clamp(inner.x + half + 2.0, (inner.right() - half - 2.0).max(inner.x + half + 2.0));
            let base = (y + 0.35 * SMALL).clamp(inner.y + SMALL + 1.0, inner.bottom() - 4.0);
            let shifts = [0.0, -1.0, 1.0, -2.0, 2.0].map(|k| base + k * (SMALL + 1.0));
            let free = |base: f64| {
                let own = [x - half, base - SMALL, x + half, base];
                let apart = |o: &[f64; 4]| own[2] < o[0] || o[2] < own[0] || own[3] < o[1] || o[3] < own[1];
                taken.iter().all(apart)
            };
            let base = shifts.into_iter().find(|b| free(*b)).unwrap_or(base);
            taken.push([x - half, base - SMALL, x + half, base]);
            let look = Lettering { rimmed: true, ..Lettering::of(SMALL).anchored(Anchor::Middle) };
            svg.text([x, base], text, &look);
        }
    }

    fn legend(&self, svg: &mut Svg, inner: Area) {
        let mut x = inner.x;
        for (paint, name) in &self.legend {
            let swatch = Area { x, y: inner.y - 19.0, width: 18.0, height: 11.0 };
            if paint.fill.is_some() {
                svg.rectangle(swatch, paint);
            } else {
                svg.line([x, inner.y - 13.5], [x + 18.0, inner.y - 13.5], paint);
            }
            svg.text([x + 24.0, inner.y - 9.5], name, &Lettering::of(SMALL).coloured(GREY));
            x += 24.0 + text_width(name, SMALL) + 18.0;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mission::Unknown;

    /// A floor of 2 x 1 m with a block on it and a bar one cell thick, 0.45 m above.
    fn view() -> TopView {
        let mut map = VoxelMap::new(0.05, [0.0; 3], [40, 20, 12], Unknown::Occupied);
        (0..4).for_each(|k| map.occupy([3, 5, k]));
        (0..20).for_each(|j| map.occupy([20, j, 9]));
        TopView::of_map(&map, 0.3)
    }

    fn drawn(view: &TopView) -> String {
        let mut svg = Svg::new(600.0, view.height(600.0), "view");
        view.draw(&mut svg, Area { x: 0.0, y: 0.0, width: 600.0, height: view.height(600.0) });
        svg.finish()
    }

    #[test]
    fn what_hangs_overhead_is_drawn_apart_from_what_stands_on_the_floor() {
        let text = drawn(&view());
        let tree = roxmltree::Document::parse(&text).expect("well-formed");
        let path = |colour: &str| {
            let of_colour = |n: &roxmltree::Node<'_, '_>| n.has_tag_name("path") && n.attribute("fill") == Some(colour);
            tree.descendants().filter(of_colour).filter_map(|n| n.attribute("d")).collect::<Vec<_>>()
        };
        // 522 px for 2 m: the bar is 13.05 wide over the whole depth, the block as wide and as deep.
        assert_eq!(path(OVERHEAD), ["M325,287 338.05,287 338.05,26 325,26Z"]);
        assert_eq!(path(OBSTACLE), ["M103.15,221.75 116.2,221.75 116.2,208.7 103.15,208.7Z"]);
    }

    #[test]
    fn notes_keep_off_each_other_and_within_the_frame() {
        let mut view = view();
        for name in ["here", "here too", "and here"] {
            view.note([1.99, 0.5], name);
        }
        let text = drawn(&view);
        let tree = roxmltree::Document::parse(&text).expect("well-formed");
        let at = |name: &str| {
            let node = tree.descendants().find(|n| n.text() == Some(name) && n.has_tag_name("text")).expect("drawn");
            ["x", "y"].map(|a| node.attribute(a).and_then(|v| v.parse::<f64>().ok()).expect("a number"))
        };
        let [a, b, c] = ["here", "here too", "and here"].map(at);
        assert!((a[1] - b[1]).abs() > SMALL && (a[1] - c[1]).abs() > SMALL && (b[1] - c[1]).abs() > SMALL);
        assert!([a, b, c].iter().all(|p| p[0] < 586.0));
    }

    #[test]
    fn a_view_of_no_points_is_drawn_too() {
        let empty = TopView::around(std::iter::empty(), 0.0);
        assert!(roxmltree::Document::parse(&drawn(&empty)).is_ok());
        let line = TopView::around([[0.0, 0.0], [3.0, 0.0], [f64::NAN, 1.0]].into_iter(), 0.5);
        assert!(line.height(800.0) > 100.0 && line.height(800.0).is_finite());
    }
}
