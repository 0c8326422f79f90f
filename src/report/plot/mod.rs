//! Pictures as SVG: charts ([`Chart`]) and views from above ([`TopView`]) one below the other on a page ([`Figure`]).
//!
//! Dark on white, with units on every axis, colours that differ for everyone and dashes where colour is lost in print. What is
//! drawn of a motion is the replay of its held commands ([`motion`]). The same content gives the same bytes.

mod chart;
pub mod motion;
mod outline;
pub mod place;
mod scale;
mod small;
pub mod svg;
mod top_view;

pub use chart::{Chart, Join, Level, Mark, Series};
pub use outline::top;
pub use scale::{Scale, Spread};
pub use small::{Small, thinned};
pub use top_view::TopView;

use svg::{Area, GREY, Lettering, Svg};

/// Width of a page, px.
const WIDTH: f64 = 860.0;
/// Height of a chart, px.
const CHART_HEIGHT: f64 = 210.0;
/// Around everything, px.
const MARGIN: f64 = 16.0;
/// Between panels, px.
const GAP: f64 = 10.0;
/// Height of a line of text, px.
const LINE: f64 = 17.0;

/// A part of a page.
#[derive(Debug, Clone, PartialEq)]
pub enum Panel {
    /// From above.
    Top(TopView),
    /// Lines over an axis.
    Chart(Chart),
}

/// A page: a title, lines of text, and panels one below the other.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Figure {
    /// On top.
    pub title: String,
    /// Below the title.
    pub lines: Vec<String>,
    /// From top to bottom.
    pub panels: Vec<Panel>,
}

impl Figure {
    /// The SVG file.
    pub fn to_svg(&self) -> String {
        let inner = WIDTH - 2.0 * MARGIN;
        let height = |panel: &Panel| match panel {
            Panel::Top(view) => view.height(inner),
            Panel::Chart(_) => CHART_HEIGHT,
        };
        let head = MARGIN + 1.3 * LINE + LINE * self.lines.len() as f64;
        let total = head + self.panels.iter().map(|p| height(p) + GAP).sum::<f64>() + MARGIN;
        let mut svg = Svg::new(WIDTH, total, &self.title);
        let look = Lettering { bold: true, ..Lettering::of(17.0) };
        svg.text([MARGIN, MARGIN + 15.0], &self.title, &look);
        for (i, line) in self.lines.iter().enumerate() {
            let y = MARGIN + 1.3 * LINE + LINE * (i as f64 + 0.7);
            svg.text([MARGIN, y], line, &Lettering::of(12.0).coloured(GREY));
        }
        let mut y = head + GAP;
        for panel in &self.panels {
            let area = Area { x: MARGIN, y, width: inner, height: height(panel) };
            match panel {
                Panel::Top(view) => view.draw(&mut svg, area),
                Panel::Chart(chart) => chart.draw(&mut svg, area),
            }
            y += area.height + GAP;
        }
        svg.finish()
    }
}
