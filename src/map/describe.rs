//! What `trajc inspect` says of a map.

use std::fmt::Write;

use super::VoxelMap;
use crate::mission::Unknown;

/// Most columns and rows of the drawing.
const WIDEST: usize = 100;
const TALLEST: usize = 60;
/// What begins higher than this above the grid's lowest cell is drawn as overhead, m.
const OVERHEAD: f64 = 0.1;

impl VoxelMap {
    /// The map in words and a view from above, at most 100 columns wide; x to the right, y up.
    pub fn describe(&self) -> String {
        let mut out = String::new();
        let bounds = self.bounds();
        let range = |a: usize| format!("{:.3} to {:.3}", bounds.min[a], bounds.max[a]);
        let [nx, ny, nz] = self.dims;
        let mut line = |key: &str, value: String| writeln!(out, "{key:<12}{value}").expect("a string takes all");
        line("cells", format!("{nx} x {ny} x {nz} of {} m, {} occupied", self.resolution, self.occupied_count()));
        line("bounds", format!("x {} m, y {} m, obstacles z {} m", range(0), range(1), range(2)));
        line(
            "beyond",
            match self.outside {
                Unknown::Occupied => "an obstacle (unknown: occupied)".into(),
                Unknown::Free => "free (unknown: free)".into(),
            },
        );
        let s = &self.statistics;
        if s.points > 0 {
            line("points", format!("{}, {} of them not finite (skipped)", s.points, s.not_finite));
        }
        if s.cut > 0 {
            line("cut", format!("{} outside height_m", s.cut));
        }
        if s.added > 0 {
            line("added", format!("{} cells by the mission's keep_out and boxes", s.added));
        }
        if s.unknown > 0 {
            let share = 100.0 * s.unknown as f64 / (nx * ny * nz) as f64;
            line(
                "unknown",
                format!("{} cells ({share:.1} %) count as obstacles only because they are unknown", s.unknown),
            );
        }
        out + "\n" + &self.top_view()
    }

    /// A character stands for `block` x `2 block` columns of cells, since characters are twice as tall as wide.
    fn top_view(&self) -> String {
        let [nx, ny, _] = self.dims;
        let block = nx.div_ceil(WIDEST).max(ny.div_ceil(2 * TALLEST));
        let overhead = (OVERHEAD / self.resolution).ceil() as usize;
        let mut out = String::new();
        let mut any_overhead = false;
        for row in (0..ny.div_ceil(2 * block)).rev() {
            let mut text = String::new();
            for column in 0..nx.div_ceil(block) {
                let mut lowest = usize::MAX;
                for i in column * block..((column + 1) * block).min(nx) {
                    for j in row * 2 * block..((row + 1) * 2 * block).min(ny) {
                        lowest = lowest.min(self.lowest(i, j).unwrap_or(usize::MAX));
                    }
                }
                any_overhead |= lowest != usize::MAX && lowest > overhead;
                text.push(if lowest == usize::MAX {
                    '.'
                } else if lowest > overhead {
                    '~'
                } else {
                    '#'
                });
            }
            out += &text;
            out.push('\n');
        }
        let size = block as f64 * self.resolution;
        let above = if any_overhead { ", ~ overhead only" } else { "" };
        out + &format!("# obstacle{above}, . free; a character is {size:.2} x {:.2} m\n", 2.0 * size)
    }

    /// The lowest occupied cell of a column.
    fn lowest(&self, i: usize, j: usize) -> Option<usize> {
        let words = self.column(i, j);
        words.iter().position(|w| *w != 0).map(|w| w * 64 + words[w].trailing_zeros() as usize)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_view_has_y_up_and_tells_overhead_from_ground() {
        let mut map = VoxelMap::new(0.1, [0.0; 3], [4, 4, 80], Unknown::Occupied);
        map.occupy([0, 0, 0]);
        map.occupy([3, 2, 70]);
        map.occupy([1, 3, 70]);
        map.occupy([1, 3, 1]);
        let text = map.describe();
        assert!(text.contains("4 x 4 x 80 of 0.1 m, 4 occupied"), "{text}");
        assert!(text.contains("\n.#.~\n#...\n"), "{text}");
    }

    #[test]
    fn the_view_of_a_large_map_is_at_most_100_wide_and_60_tall() {
        for dims in [[1000, 3, 1], [3, 1000, 1], [101, 121, 1]] {
            let text = VoxelMap::new(0.05, [0.0; 3], dims, Unknown::Free).top_view();
            assert!(text.lines().filter(|l| l.starts_with('.')).all(|l| l.len() <= 100), "{text}");
            assert!(text.lines().filter(|l| l.starts_with('.')).count() <= 60, "{text}");
        }
    }
}
