//! A small SVG writer: shapes and texts in pixels, origin at the upper left. The same calls give the same bytes.

use std::fmt::Write;

/// Text and axes.
pub const INK: &str = "#1a1a1a";
/// What stands back: ticks, notes.
pub const GREY: &str = "#5c5c5c";
/// Lines of a grid.
pub const FAINT: &str = "#e4e4e4";
/// Colours that people with any kind of colour vision tell apart, and that differ in lightness in grey print. Okabe and Ito,
/// "Color Universal Design", 2008.
pub const COLOURS: [&str; 6] = ["#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9"];

/// The page itself, and what parts a text from the drawing below it.
const PAPER: &str = "#ffffff";

/// The property of a web page's style sheet that stands for a colour of the kit, so that drawings within the page follow its light or
/// dark palette. Colours of no role stay what they are.
fn role(colour: &'static str) -> &'static str {
    match colour {
        INK => "var(--ink)",
        GREY => "var(--muted)",
        FAINT => "var(--rule)",
        PAPER => "var(--paper)",
        _ => {
            let lines = ["var(--c1)", "var(--c2)", "var(--c3)", "var(--c4)", "var(--c5)", "var(--c6)"];
            COLOURS.iter().position(|c| *c == colour).map_or(colour, |i| lines[i])
        }
    }
}

/// A rectangle of the page, px.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Area {
    /// Left edge.
    pub x: f64,
    /// Upper edge.
    pub y: f64,
    /// To the right.
    pub width: f64,
    /// Downwards.
    pub height: f64,
}

impl Area {
    /// Without a margin on each side.
    pub fn inside(self, left: f64, top: f64, right: f64, bottom: f64) -> Self {
        Self {
            x: self.x + left,
            y: self.y + top,
            width: (self.width - left - right).max(0.0),
            height: (self.height - top - bottom).max(0.0),
        }
    }

    /// Right edge.
    pub fn right(self) -> f64 {
        self.x + self.width
    }

    /// Lower edge.
    pub fn bottom(self) -> f64 {
        self.y + self.height
    }
}

/// How a shape is painted.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Paint {
    /// Colour inside.
    pub fill: Option<&'static str>,
    /// Of the inside, 0 to 1.
    pub fill_opacity: f64,
    /// Colour of the line.
    pub stroke: Option<&'static str>,
    /// Of the line, px.
    pub width: f64,
    /// Lengths of dashes and gaps, px.
    pub dash: Option<&'static str>,
}

impl Paint {
    /// A line of a colour.
    pub const fn line(colour: &'static str, width: f64) -> Self {
        Self { fill: None, fill_opacity: 1.0, stroke: Some(colour), width, dash: None }
    }

    /// An area of a colour.
    pub const fn fill(colour: &'static str) -> Self {
        Self { fill: Some(colour), fill_opacity: 1.0, stroke: None, width: 0.0, dash: None }
    }

    /// Dashed.
    pub const fn dashed(self, dash: &'static str) -> Self {
        Self { dash: Some(dash), ..self }
    }

    /// With a translucent inside.
    pub const fn tinted(self, colour: &'static str, opacity: f64) -> Self {
        Self { fill: Some(colour), fill_opacity: opacity, ..self }
    }

    fn attributes(&self, inline: bool) -> String {
        let named = |colour: &'static str| if inline { role(colour) } else { colour };
        let mut out = format!(" fill=\"{}\"", self.fill.map_or("none", named));
        if self.fill.is_some() && self.fill_opacity < 1.0 {
            let _ = write!(out, " fill-opacity=\"{}\"", number(self.fill_opacity));
        }
        if let Some(stroke) = self.stroke {
            let _ = write!(out, " stroke=\"{}\" stroke-width=\"{}\"", named(stroke), number(self.width));
        }
        if let Some(dash) = self.dash {
            let _ = write!(out, " stroke-dasharray=\"{dash}\"");
        }
        out
    }
}

/// Which end of a text is where it is put.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Anchor {
    /// Its beginning.
    Start,
    /// Its middle.
    Middle,
    /// Its end.
    End,
}

/// How a text looks.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Lettering {
    /// px.
    pub size: f64,
    /// Colour.
    pub colour: &'static str,
    /// Which end is at the place given.
    pub anchor: Anchor,
    /// Bold.
    pub bold: bool,
    /// Reads upwards instead of to the right.
    pub upwards: bool,
    /// Stands on a white rim, to be read on top of a drawing.
    pub rimmed: bool,
}

impl Lettering {
    /// Upright text of a size, in ink, beginning at its place.
    pub const fn of(size: f64) -> Self {
        Self { size, colour: INK, anchor: Anchor::Start, bold: false, upwards: false, rimmed: false }
    }

    /// With its other end or middle there.
    pub const fn anchored(self, anchor: Anchor) -> Self {
        Self { anchor, ..self }
    }

    /// In a colour.
    pub const fn coloured(self, colour: &'static str) -> Self {
        Self { colour, ..self }
    }
}

/// A picture in the making.
#[derive(Debug, Clone, PartialEq)]
pub struct Svg {
    text: String,
    clips: usize,
    /// Of a drawing within a web page: its name there, which keeps its parts' names apart from others'.
    inline: Option<String>,
}

impl Svg {
    /// A white page of a size in px. `title` is what screen readers say and browsers show.
    pub fn new(width: f64, height: f64, title: &str) -> Self {
        let (w, h) = (number(width), number(height));
        let text = format!(
            "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{w}\" height=\"{h}\" viewBox=\"0 0 {w} {h}\" role=\"img\" \
             font-family=\"Helvetica, Arial, 'Liberation Sans', sans-serif\">\n<title>{}</title>\n\
             <rect width=\"{w}\" height=\"{h}\" fill=\"#ffffff\"/>\n",
            escaped(title)
        );
        Self { text, clips: 0, inline: None }
    }

    /// A drawing within a web page: as wide as its place there, without a ground of its own, in the page's font, its colours the page's
    /// properties `--ink`, `--muted`, `--rule`, `--paper`, `--c1` to `--c6`. `id` is unique in the page: letters and digits.
    pub fn inline(width: f64, height: f64, title: &str, id: &str) -> Self {
        let (w, h) = (number(width), number(height));
        let text = format!("<svg viewBox=\"0 0 {w} {h}\" role=\"img\" aria-label=\"{}\">\n", escaped(title));
        Self { text, clips: 0, inline: Some(id.to_owned()) }
    }

    fn attributes(&self, paint: &Paint) -> String {
        paint.attributes(self.inline.is_some())
    }

    fn colour(&self, colour: &'static str) -> &'static str {
        if self.inline.is_some() { role(colour) } else { colour }
    }

    /// A straight line.
    pub fn line(&mut self, from: [f64; 2], to: [f64; 2], paint: &Paint) {
        let [[x1, y1], [x2, y2]] = [from, to].map(|p| p.map(number));
        self.push(&format!("<line x1=\"{x1}\" y1=\"{y1}\" x2=\"{x2}\" y2=\"{y2}\"{}/>", self.attributes(paint)));
    }

    /// A rectangle.
    pub fn rectangle(&mut self, area: Area, paint: &Paint) {
        let [x, y, w, h] = [area.x, area.y, area.width, area.height].map(number);
        self.push(&format!("<rect x=\"{x}\" y=\"{y}\" width=\"{w}\" height=\"{h}\"{}/>", self.attributes(paint)));
    }

    /// A circle.
    pub fn circle(&mut self, centre: [f64; 2], radius: f64, paint: &Paint) {
        let [x, y] = centre.map(number);
        self.push(&format!("<circle cx=\"{x}\" cy=\"{y}\" r=\"{}\"{}/>", number(radius), self.attributes(paint)));
    }

    /// A line through points; not finite ones break it.
    pub fn polyline(&mut self, points: &[[f64; 2]], paint: &Paint) {
        for run in points.split(|p| !p.iter().all(|v| v.is_finite())) {
            if run.len() > 1 {
                let line = format!("<polyline points=\"{}\" stroke-linejoin=\"round\"", listed(run));
                self.push(&format!("{line}{}/>", self.attributes(paint)));
            }
        }
    }

    /// A line that holds each point's height until the next point; to a tenth of a pixel, runs of one height as one.
    pub fn steps(&mut self, points: &[[f64; 2]], paint: &Paint) {
        let tenth = |v: f64| number((10.0 * v).round() / 10.0);
        let mut path = String::new();
        for run in points.split(|p| !p.iter().all(|v| v.is_finite())).filter(|run| !run.is_empty()) {
            let [x, y] = run[0].map(tenth);
            let mut height = y.clone();
            let _ = write!(path, "M{x} {y}");
            for [x, y] in &run[1..] {
                let (x, y) = (tenth(*x), tenth(*y));
                if y != height {
                    let _ = write!(path, "H{x}V{y}");
                    height = y;
                }
            }
            if let [_, .., last] = run {
                let _ = write!(path, "H{}", tenth(last[0]));
            }
        }
        if !path.is_empty() {
            self.push(&format!("<path d=\"{path}\"{}/>", self.attributes(paint)));
        }
    }

    /// A line that a page's script moves along an axis from `low` to `high` at the left and right edges of `area`; not seen without it.
    pub fn cursor(&mut self, area: Area, [low, high]: [f64; 2]) {
        let [x, right, y, bottom] = [area.x, area.right(), area.y, area.bottom()].map(number);
        let stroke = self.colour(INK);
        self.push(&format!(
            "<line class=\"now\" data-axis=\"{low} {high} {x} {right}\" x1=\"{x}\" y1=\"{y}\" x2=\"{x}\" y2=\"{bottom}\" \
             stroke=\"{stroke}\" visibility=\"hidden\"/>"
        ));
    }

    /// Closed outlines as one shape; where an even number of them overlap there is a hole.
    pub fn outlines(&mut self, loops: &[Vec<[f64; 2]>], paint: &Paint) {
        let mut path = String::new();
        for points in loops.iter().filter(|l| l.len() > 2) {
            let _ = write!(path, "M{}Z", listed(points));
        }
        if !path.is_empty() {
            self.push(&format!("<path d=\"{path}\" fill-rule=\"evenodd\"{}/>", self.attributes(paint)));
        }
    }

    /// A line of text; `at` is on its base line.
    pub fn text(&mut self, at: [f64; 2], text: &str, look: &Lettering) {
        let [x, y] = at.map(number);
        let mut head = format!("<text x=\"{x}\" y=\"{y}\" font-size=\"{}\"", number(look.size));
        match look.anchor {
            Anchor::Start => {}
            Anchor::Middle => head += " text-anchor=\"middle\"",
            Anchor::End => head += " text-anchor=\"end\"",
        }
        if look.bold {
            head += " font-weight=\"bold\"";
        }
        if look.upwards {
            let _ = write!(head, " transform=\"rotate(-90 {x} {y})\"");
        }
        let text = escaped(text);
        if look.rimmed {
            let paper = self.colour(PAPER);
            let rim = format!("fill=\"{paper}\" stroke=\"{paper}\" stroke-width=\"3\" stroke-linejoin=\"round\"");
            self.push(&format!("{head} {rim}>{text}</text>"));
        }
        self.push(&format!("{head} fill=\"{}\">{text}</text>", self.colour(look.colour)));
    }

    /// What `draw` draws, cut at an area's edges.
    pub fn within(&mut self, area: Area, draw: impl FnOnce(&mut Self)) {
        self.clips += 1;
        let id = format!("{}clip{}", self.inline.as_deref().unwrap_or_default(), self.clips);
        let [x, y, w, h] = [area.x, area.y, area.width, area.height].map(number);
        self.push(&format!(
            "<clipPath id=\"{id}\"><rect x=\"{x}\" y=\"{y}\" width=\"{w}\" height=\"{h}\"/></clipPath>\n\
             <g clip-path=\"url(#{id})\">"
        ));
        draw(self);
        self.push("</g>");
    }

    /// The file.
    pub fn finish(mut self) -> String {
        self.text += "</svg>\n";
        self.text
    }

    fn push(&mut self, element: &str) {
        self.text += element;
        self.text.push('\n');
    }
}

/// Width of a text, px, as far as it can be told without the font.
pub fn text_width(text: &str, size: f64) -> f64 {
    0.54 * size * text.chars().count() as f64
}

/// Two decimals at most: a hundredth of a pixel is not seen. What is not finite is put at 0.
fn number(value: f64) -> String {
    let text = format!("{:.2}", if value.is_finite() { value } else { 0.0 });
    let short = text.trim_end_matches('0').trim_end_matches('.');
    if short == "-0" { "0".into() } else { short.into() }
}

fn listed(points: &[[f64; 2]]) -> String {
    let mut out = String::new();
    for [x, y] in points {
        let space = if out.is_empty() { "" } else { " " };
        let _ = write!(out, "{space}{},{}", number(*x), number(*y));
    }
    out
}

/// As text of an element; what XML does not allow is replaced.
fn escaped(text: &str) -> String {
    let mut out = String::with_capacity(text.len());
    for c in text.chars() {
        match c {
            '&' => out += "&amp;",
            '<' => out += "&lt;",
            '>' => out += "&gt;",
            '"' => out += "&quot;",
            c if c.is_control() || matches!(c, '\u{fffe}' | '\u{ffff}') => out.push('\u{fffd}'),
            c => out.push(c),
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn any_text_makes_well_formed_xml_that_says_the_same() {
        let mut svg = Svg::new(10.0, 20.0, "a < b & \"c\"");
        svg.text([1.0, 2.0], "x <y> & 'z'\u{0}", &Lettering { rimmed: true, upwards: true, ..Lettering::of(9.0) });
        let text = svg.finish();
        let tree = roxmltree::Document::parse(&text).expect("well-formed");
        let title = tree.descendants().find(|n| n.has_tag_name("title")).and_then(|n| n.text().map(str::to_owned));
        assert_eq!(title.as_deref(), Some("a < b & \"c\""));
        let texts: Vec<_> = tree.descendants().filter(|n| n.has_tag_name("text")).filter_map(|n| n.text()).collect();
        assert_eq!(texts, ["x <y> & 'z'\u{fffd}"; 2]);
    }

    #[test]
    fn drawings_in_a_page_take_its_colours_and_keep_their_names_apart() {
        let drawn = |id: &str| {
            let mut svg = Svg::inline(9.0, 9.0, "\"one\"", id);
            svg.within(Area { x: 0.0, y: 0.0, width: 9.0, height: 9.0 }, |svg| {
                svg.line([0.0; 2], [9.0; 2], &Paint::line(COLOURS[1], 1.0).tinted("#123456", 0.5));
            });
            svg.text([1.0, 1.0], "a", &Lettering { rimmed: true, ..Lettering::of(9.0) });
            svg.finish()
        };
        let page = format!("<p>{}{}</p>", drawn("a"), drawn("b"));
        let tree = roxmltree::Document::parse(&page).expect("well-formed");
        let ids: Vec<_> = tree.descendants().filter_map(|n| n.attribute("id")).collect();
        assert_eq!(ids, ["aclip1", "bclip1"]);
        let line = tree.descendants().find(|n| n.has_tag_name("line")).expect("drawn");
        assert_eq!([line.attribute("stroke"), line.attribute("fill")], [Some("var(--c2)"), Some("#123456")]);
        assert!(!page.contains(INK) && !page.contains("#ffffff") && page.contains("var(--ink)"));
    }

    #[test]
    fn steps_turn_at_the_points_and_leave_out_what_is_level() {
        let mut svg = Svg::new(9.0, 9.0, "steps");
        svg.steps(
            &[[0.0, 1.0], [1.0, 1.04], [2.0, 3.0], [3.0, 3.0], [f64::NAN, 0.0], [5.0, 2.0], [6.0, 2.0]],
            &Paint::line(INK, 1.0),
        );
        assert!(svg.finish().contains("d=\"M0 1H2V3H3M5 2H6\""));
    }

    #[test]
    fn numbers_are_short_and_never_a_word() {
        let cases = [(1.0, "1"), (-0.001, "0"), (0.126, "0.13"), (100.0, "100"), (f64::NAN, "0"), (-2.5, "-2.5")];
        for (value, expected) in cases {
            assert_eq!(number(value), expected);
        }
    }

    #[test]
    fn a_gap_in_the_points_is_a_gap_in_the_line() {
        let mut svg = Svg::new(9.0, 9.0, "gap");
        let points = [[0.0, 0.0], [1.0, 1.0], [f64::NAN, 2.0], [3.0, 3.0], [4.0, 4.0], [5.0, f64::INFINITY]];
        svg.polyline(&points, &Paint::line(INK, 1.0));
        let text = svg.finish();
        assert_eq!(text.matches("<polyline").count(), 2);
        assert!(text.contains("points=\"0,0 1,1\"") && text.contains("points=\"3,3 4,4\""), "{text}");
    }
}
