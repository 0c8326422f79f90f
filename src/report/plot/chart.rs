//! Charts: lines over an axis, with their limits, units and names.

use super::scale::{Scale, Spread};
use super::svg::{Anchor, Area, COLOURS, FAINT, GREY, INK, Lettering, Paint, Svg, text_width};

/// Room for the values and the name of the vertical axis, px.
pub(super) const LEFT: f64 = 64.0;
/// Room on the right, px.
pub(super) const RIGHT: f64 = 14.0;
/// Room for the title and the names of the lines, px.
const TOP: f64 = 26.0;
/// Room for the values and the name of the horizontal axis, px.
pub(super) const BOTTOM: f64 = 38.0;
/// px.
pub(super) const SMALL: f64 = 11.0;
/// px.
const HEADING: f64 = 13.0;
/// Radius of a mark, px.
pub(super) const RING: f64 = 4.5;
/// Dashes tell lines apart where colour is lost.
const DASHES: [Option<&str>; 3] = [None, Some("7 3"), Some("2 2")];

/// How points become a line.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Join {
    /// Straight from one to the next.
    Straight,
    /// Each value is held until the next point.
    Held,
    /// A dot each, joined by thin lines.
    Dots,
}

/// One line of a chart.
#[derive(Debug, Clone, PartialEq)]
pub struct Series {
    /// What it is, in the legend; empty: not named there.
    pub name: String,
    /// By the horizontal value, in order; what is not finite is a gap.
    pub points: Vec<[f64; 2]>,
    /// Between the points.
    pub join: Join,
}

/// A point that is marked.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Mark {
    /// Where.
    pub at: [f64; 2],
    /// The line in whose colour it is.
    pub series: usize,
}

/// A dashed line across a chart at one value.
#[derive(Debug, Clone, PartialEq)]
pub struct Level {
    /// Written on it; empty: nothing is.
    pub name: String,
    /// On the vertical axis.
    pub value: f64,
}

/// A chart.
#[derive(Debug, Clone, PartialEq)]
pub struct Chart {
    /// Above it.
    pub title: String,
    /// Name and unit of the horizontal axis.
    pub x_label: String,
    /// Name and unit of the vertical axis.
    pub y_label: String,
    /// How the horizontal axis is spread.
    pub x_spread: Spread,
    /// How the vertical axis is spread.
    pub y_spread: Spread,
    /// Lines, in the order of their colours.
    pub series: Vec<Series>,
    /// Limits and the like; the axis shows them all.
    pub levels: Vec<Level>,
    /// Rings around points.
    pub marks: Vec<Mark>,
}

impl Chart {
    /// Without lines, on even axes. Labels have the unit at their end, such as `time s`.
    pub fn new(title: impl Into<String>, x_label: impl Into<String>, y_label: impl Into<String>) -> Self {
        Self {
            title: title.into(),
            x_label: x_label.into(),
            y_label: y_label.into(),
            x_spread: Spread::Linear,
            y_spread: Spread::Linear,
            series: Vec::new(),
            levels: Vec::new(),
            marks: Vec::new(),
        }
    }

    /// With one more line.
    #[must_use]
    pub fn line(mut self, name: impl Into<String>, points: Vec<[f64; 2]>, join: Join) -> Self {
        self.series.push(Series { name: name.into(), points, join });
        self
    }

    /// With a dashed line across.
    #[must_use]
    pub fn level(mut self, name: impl Into<String>, value: f64) -> Self {
        self.levels.push(Level { name: name.into(), value });
        self
    }

    /// With a ring around a point, in the colour of a line.
    #[must_use]
    pub fn mark(mut self, at: [f64; 2], series: usize) -> Self {
        self.marks.push(Mark { at, series });
        self
    }

    /// The axes.
    pub(super) fn scales(&self) -> [Scale; 2] {
        let points = || self.series.iter().flat_map(|s| &s.points).filter(|p| p.iter().all(|v| v.is_finite()));
        let x = match self.x_spread {
            Spread::Linear => {
                // Where a line has gaps the axis goes on: charts below each other share it.
                let all = self.series.iter().flat_map(|s| &s.points).map(|p| p[0]).filter(|x| x.is_finite());
                let (low, high) = all.fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), x| (l.min(x), h.max(x)));
                if low > high { Scale::exactly(0.0, 1.0) } else { Scale::exactly(low, high) }
            }
            Spread::Logarithmic => Scale::around(points().map(|p| p[0]), Spread::Logarithmic),
        };
        let values = points().map(|p| p[1]).chain(self.levels.iter().map(|l| l.value));
        [x, Scale::around(values, self.y_spread)]
    }

    /// Draws it into an area, labels included.
    pub fn draw(&self, svg: &mut Svg, area: Area) {
        let inner = area.inside(LEFT, TOP, RIGHT, BOTTOM);
        let [x, y] = self.scales();
        let place = |[u, v]: [f64; 2]| [inner.x + x.share(u) * inner.width, inner.bottom() - y.share(v) * inner.height];
        axes(svg, inner, [&x, &y], [&self.x_label, &self.y_label]);
        let mut taken: Vec<f64> = Vec::new();
        for level in &self.levels {
            let at = place([x.low, level.value])[1];
            svg.line([inner.x, at], [inner.right(), at], &Paint::line(INK, 1.0).dashed("4 3"));
            // A name that would lie on another's is left out: limits of both signs share theirs.
            if !level.name.is_empty() && taken.iter().all(|t| (t - at).abs() > SMALL) {
                taken.push(at);
                let above = if at - SMALL < inner.y { at + SMALL } else { at - 3.0 };
                let look = Lettering { rimmed: true, ..Lettering::of(SMALL).anchored(Anchor::End) };
                svg.text([inner.right() - 4.0, above], &level.name, &look);
            }
        }
        svg.within(inner.inside(-2.0, -2.0, -2.0, -2.0), |svg| {
            for (i, series) in self.series.iter().enumerate() {
                series.draw(svg, &paint(i), place);
            }
        });
        for mark in &self.marks {
            svg.circle(place(mark.at), RING, &Paint::line(COLOURS[mark.series % COLOURS.len()], 1.6));
        }
        svg.rectangle(inner, &Paint::line(INK, 1.0));
        let look = Lettering { bold: true, ..Lettering::of(HEADING) };
        svg.text([inner.x, inner.y - 9.0], &self.title, &look);
        self.legend(svg, inner);
    }

    /// Names of the lines, to the right of the title.
    fn legend(&self, svg: &mut Svg, inner: Area) {
        let mut x = inner.right();
        for (i, series) in self.series.iter().enumerate().rev().filter(|(_, s)| !s.name.is_empty()) {
            svg.text([x, inner.y - 9.0], &series.name, &Lettering::of(SMALL).anchored(Anchor::End));
            x -= text_width(&series.name, SMALL) + 6.0;
            svg.line([x - 24.0, inner.y - 13.0], [x, inner.y - 13.0], &Paint { width: 2.0, ..paint(i) });
            x -= 24.0 + 16.0;
        }
    }
}

/// The paint of line i.
pub(super) fn paint(i: usize) -> Paint {
    Paint { dash: DASHES[i % DASHES.len()], ..Paint::line(COLOURS[i % COLOURS.len()], 1.6) }
}

impl Series {
    pub(super) fn draw(&self, svg: &mut Svg, paint: &Paint, place: impl Fn([f64; 2]) -> [f64; 2]) {
        if self.join == Join::Held {
            return svg.steps(&self.points.iter().copied().map(place).collect::<Vec<_>>(), paint);
        }
        let line = &self.points;
        let placed: Vec<[f64; 2]> = line.iter().copied().map(&place).collect();
        if self.join == Join::Dots {
            svg.polyline(&placed, &Paint { width: 0.8, ..*paint });
            let dot = Paint::fill(paint.stroke.unwrap_or(INK));
            placed.iter().filter(|p| p.iter().all(|v| v.is_finite())).for_each(|p| svg.circle(*p, 3.0, &dot));
        } else {
            svg.polyline(&placed, paint);
        }
    }
}

/// Grid lines, values and names of both axes around `inner`.
pub(super) fn axes(svg: &mut Svg, inner: Area, scales: [&Scale; 2], labels: [&str; 2]) {
    let [x, y] = scales;
    let small = Lettering::of(SMALL).coloured(GREY);
    for (value, text) in x.ticks((inner.width / 75.0) as usize) {
        let at = inner.x + x.share(value) * inner.width;
        svg.line([at, inner.y], [at, inner.bottom()], &Paint::line(FAINT, 1.0));
        svg.text([at, inner.bottom() + 14.0], &text, &small.anchored(Anchor::Middle));
    }
    for (value, text) in y.ticks((inner.height / if inner.height > 300.0 { 50.0 } else { 28.0 }).max(2.0) as usize) {
        let at = inner.bottom() - y.share(value) * inner.height;
        svg.line([inner.x, at], [inner.right(), at], &Paint::line(FAINT, 1.0));
        svg.text([inner.x - 6.0, at + 4.0], &text, &small.anchored(Anchor::End));
    }
    let name = Lettering::of(SMALL + 1.0).anchored(Anchor::Middle);
    svg.text([inner.x + 0.5 * inner.width, inner.bottom() + 30.0], labels[0], &name);
    let upwards = Lettering { upwards: true, ..name };
    svg.text([inner.x - LEFT + 16.0, inner.y + 0.5 * inner.height], labels[1], &upwards);
}

#[cfg(test)]
mod tests {
    use super::*;

    const AREA: Area = Area { x: 0.0, y: 0.0, width: 600.0, height: 200.0 };

    fn drawn(chart: &Chart) -> String {
        let mut svg = Svg::new(600.0, 200.0, "chart");
        chart.draw(&mut svg, AREA);
        svg.finish()
    }

    #[test]
    fn a_chart_names_its_axes_lines_and_limits() {
        let chart = Chart::new("Wheels", "time s", "rim speed m/s")
            .line("left", vec![[0.0, 0.1], [0.1, 0.2], [0.2, 0.0]], Join::Held)
            .line("right", vec![[0.0, -0.1], [0.1, 0.3], [0.2, 0.0]], Join::Straight)
            .level("limit", 0.5);
        let text = drawn(&chart);
        let tree = roxmltree::Document::parse(&text).expect("well-formed");
        let texts: Vec<&str> = tree.descendants().filter(|n| n.has_tag_name("text")).filter_map(|n| n.text()).collect();
        for expected in ["Wheels", "time s", "rim speed m/s", "left", "right", "limit", "0.4"] {
            assert!(texts.contains(&expected), "{expected} in {texts:?}");
        }
        assert_eq!(text, drawn(&chart));
    }

    #[test]
    fn a_held_value_goes_on_to_the_next_point_and_turns_there() {
        let chart = Chart::new("", "", "").line("", vec![[0.0, 0.0], [1.0, 1.0], [2.0, 0.0]], Join::Held);
        let text = drawn(&chart);
        let path = text.split("<path d=\"M").nth(1).and_then(|t| t.split('"').next()).expect("a line");
        let numbers: Vec<f64> = path.split([' ', 'H', 'V']).map(|n| n.parse().expect("a number")).collect();
        let [x0, y0, x1, y1, x2, y2, end] = numbers[..] else { panic!("{path}") };
        assert!(x0 < x1 && x1 < x2 && y2 == y0 && end == x2, "level to the next point, there up or down: {path}");
        assert!(y1 < y0, "larger values are higher on the page");
    }

    #[test]
    fn charts_of_nothing_are_drawn_too() {
        for spread in [Spread::Linear, Spread::Logarithmic] {
            let chart = Chart { x_spread: spread, y_spread: spread, ..Chart::new("empty", "x", "y") };
            let chart = chart.line("none", vec![[f64::NAN, 1.0]], Join::Dots);
            assert!(roxmltree::Document::parse(&drawn(&chart)).is_ok());
        }
    }
}
