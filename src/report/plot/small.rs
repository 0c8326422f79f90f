//! Charts for a place within a web page: few lines of frame, values beside the axis, names above the drawing.

use super::chart::{RING, paint};
use super::scale::Spread;
use super::svg::{Anchor, Area, COLOURS, FAINT, GREY, INK, Lettering, Paint, Svg, text_width};
use super::{Chart, Level};

/// Room for the values of the vertical axis, px.
const LEFT: f64 = 44.0;
/// Room on the right, px.
const RIGHT: f64 = 10.0;
/// A line of text above the drawing, px.
const LINE: f64 = 18.0;
/// Room for the values of the horizontal axis, px.
const BOTTOM: f64 = 22.0;
/// Of values and names, px.
const SMALL: f64 = 11.5;
/// Of lines, px.
const STROKE: f64 = 1.4;
/// Of the title, px.
const HEADING: f64 = 13.0;

/// How large such a chart is drawn, and what it is in the page.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Small<'a> {
    /// px; the page may scale it.
    pub width: f64,
    /// px.
    pub height: f64,
    /// Its name in the page, letters and digits.
    pub id: &'a str,
    /// Whether the horizontal axis is time: such charts have a cursor that the page moves.
    pub over_time: bool,
}

impl Small<'_> {
    /// The chart as an element of a page. Its title takes the vertical axis' name after a comma; names of lines are written below it, in
    /// their colours. The axis shows levels without a name too, but no line is drawn for them.
    pub fn draw(&self, chart: &Chart) -> String {
        let title = format!("{}, {}", chart.title, chart.y_label);
        let title = title.trim_end_matches([' ', ',']);
        let mut svg = Svg::inline(self.width, self.height, title, self.id);
        let named = chart.series.iter().any(|s| !s.name.is_empty());
        let top = LINE + if named { LINE } else { 0.0 } + 8.0;
        let inner = Area { x: 0.0, y: 0.0, width: self.width, height: self.height }.inside(LEFT, top, RIGHT, BOTTOM);
        let [x, y] = chart.scales();
        let place = |[u, v]: [f64; 2]| [inner.x + x.share(u) * inner.width, inner.bottom() - y.share(v) * inner.height];

        svg.text([0.0, HEADING], title, &Lettering { bold: true, ..Lettering::of(HEADING) });
        names(&mut svg, chart);
        let small = Lettering::of(SMALL).coloured(GREY);
        for (value, text) in y.ticks((inner.height / 34.0).max(2.0) as usize) {
            let at = inner.bottom() - y.share(value) * inner.height;
            svg.line([inner.x, at], [inner.right(), at], &Paint::line(FAINT, 1.0));
            svg.text([inner.x - 6.0, at + 4.0], &text.replace('-', "−"), &small.anchored(Anchor::End));
        }
        let ticks = x.ticks((inner.width / 70.0) as usize);
        let unit = chart.x_label.rsplit(' ').next().unwrap_or_default();
        for (i, (value, text)) in ticks.iter().enumerate() {
            let at = inner.x + x.share(*value) * inner.width;
            if x.spread == Spread::Logarithmic {
                svg.line([at, inner.y], [at, inner.bottom()], &Paint::line(FAINT, 1.0));
            }
            let text = if i + 1 == ticks.len() { format!("{text} {unit}") } else { text.clone() };
            let half = 0.5 * text_width(&text, SMALL);
            let at = at.min(self.width - half);
            svg.text([at, inner.bottom() + 15.0], &text, &small.anchored(Anchor::Middle));
        }
        let levels = || chart.levels.iter().filter(|level| !level.name.is_empty());
        let height = |level: &Level| place([x.low, level.value])[1];
        for level in levels() {
            svg.line([inner.x, height(level)], [inner.right(), height(level)], &Paint::line(INK, 1.0).dashed("4 3"));
        }
        svg.within(inner.inside(-2.0, -2.0, -2.0, -2.0), |svg| {
            for (i, series) in chart.series.iter().enumerate() {
                series.draw(svg, &Paint { width: STROKE, ..paint(i) }, place);
            }
        });
        let mut taken: Vec<f64> = Vec::new();
        for level in levels() {
            let at = height(level);
            if taken.iter().all(|t| (t - at).abs() > SMALL) {
                taken.push(at);
                let above = if at - SMALL < inner.y { at + SMALL } else { at - 4.0 };
                let look = Lettering { rimmed: true, ..Lettering::of(SMALL).anchored(Anchor::End) };
                svg.text([inner.right(), above], &level.name, &look);
            }
        }
        if self.over_time {
            svg.cursor(inner, [x.low, x.high]);
        }
        for mark in &chart.marks {
            let colour = COLOURS[mark.series % COLOURS.len()];
            svg.circle(place(mark.at), RING, &Paint::line(colour, 2.0).tinted("#ffffff", 0.9));
        }
        svg.finish()
    }
}

/// Names of the lines below the title.
fn names(svg: &mut Svg, chart: &Chart) {
    let mut x = 0.0;
    for (i, series) in chart.series.iter().enumerate().filter(|(_, s)| !s.name.is_empty()) {
        let y = HEADING + LINE;
        svg.line([x, y - 4.0], [x + 14.0, y - 4.0], &Paint { width: 2.5, ..paint(i) });
        svg.text([x + 19.0, y], &series.name, &Lettering::of(SMALL).coloured(GREY));
        x += 19.0 + text_width(&series.name, SMALL) + 12.0;
    }
}

/// At most about `count` of the points, the least and the greatest value of each stretch among them, so that peaks stay.
pub fn thinned(points: &[[f64; 2]], count: usize) -> Vec<[f64; 2]> {
    if points.len() <= count {
        return points.to_vec();
    }
    let stretch = (2 * points.len()).div_ceil(count.max(2));
    let mut out = Vec::with_capacity(count + 2);
    for part in points.chunks(stretch) {
        let by_value = |a: &(usize, &[f64; 2]), b: &(usize, &[f64; 2])| a.1[1].total_cmp(&b.1[1]);
        let ends = [part.iter().enumerate().min_by(by_value), part.iter().enumerate().max_by(by_value)];
        let mut ends: Vec<usize> = ends.into_iter().flatten().map(|(i, _)| i).collect();
        ends.sort_unstable();
        ends.dedup();
        out.extend(ends.into_iter().map(|i| part[i]));
    }
    // The axis ends where the points do.
    for end in [points.first(), points.last()].into_iter().flatten() {
        match end {
            e if out.first().is_some_and(|f| f[0] > e[0]) => out.insert(0, *e),
            e if out.last().is_some_and(|l| l[0] < e[0]) => out.push(*e),
            _ => {}
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::super::{Chart, Join};
    use super::*;

    #[test]
    fn a_small_chart_says_its_unit_names_its_lines_and_has_a_cursor_over_time() {
        let chart = Chart::new("Wheel speed", "time s", "m/s")
            .line("left, peak 0.3 at 1 s", vec![[0.0, 0.1], [1.0, 0.3], [2.0, 0.0]], Join::Held)
            .level("limit", 0.5)
            .mark([1.0, 0.3], 0);
        let draw = |over_time| Small { width: 400.0, height: 180.0, id: "a", over_time }.draw(&chart);
        let text = draw(true);
        let tree = roxmltree::Document::parse(&text).expect("well-formed");
        let texts: Vec<&str> = tree.descendants().filter(|n| n.has_tag_name("text")).filter_map(|n| n.text()).collect();
        for expected in ["Wheel speed, m/s", "left, peak 0.3 at 1 s", "limit", "2.0 s"] {
            assert!(texts.contains(&expected), "{expected} in {texts:?}");
        }
        let cursor = tree.descendants().find(|n| n.attribute("class") == Some("now")).expect("a cursor");
        assert_eq!(cursor.attribute("data-axis"), Some("0 2 44 390"));
        assert!(text.contains("<circle") && !draw(false).contains("class=\"now\""));
    }

    #[test]
    fn thinning_keeps_ends_order_and_every_peak() {
        let points: Vec<[f64; 2]> = (0..10_000u32).map(|i| [f64::from(i), f64::from(i * 7919 % 1009)]).collect();
        let mut points = points;
        points[4321][1] = 5e3;
        points[8765][1] = -5e3;
        let thin = thinned(&points, 500);
        assert!(thin.len() <= 504 && thin.windows(2).all(|w| w[0][0] < w[1][0]));
        assert!(thin.contains(&points[4321]) && thin.contains(&points[8765]));
        assert_eq!([thin[0][0], thin[thin.len() - 1][0]], [0.0, 9999.0]);
        assert_eq!(thinned(&points[..9], 9), points[..9]);
    }
}
