//! Occupancy images whose origin is turned: pixels as squares that lie askew on the grid of cells.
//!
//! A cell is what any pixel says that it overlaps: nothing of an obstacle is lost. By quarter turns pixels are cells again.

use std::f64::consts::FRAC_PI_2;

use super::occupancy::Seen;
use crate::math::real;

/// Overlaps below this part of a cell are rounding.
const TOUCH: f64 = 1e-6;

/// Cells seen from above. Cell (i, j) is `cells[j * width + i]`, j along y.
pub(super) struct Sheet {
    pub(super) width: usize,
    pub(super) height: usize,
    pub(super) cells: Vec<Seen>,
}

/// Turns pixels (j upwards) about their lower left corner, `yaw` radians from x to y. Returns the turned cells and where their lower
/// left corner lies from the image's, in cells. What the image does not cover is unknown.
pub(super) fn turn(sheet: Sheet, yaw: f64) -> (Sheet, [f64; 2]) {
    let quarters = (yaw / FRAC_PI_2).round();
    if (yaw - quarters * FRAC_PI_2).abs() <= 1e-9 {
        let (mut sheet, mut corner) = (sheet, [0.0; 2]);
        for _ in 0..quarters.rem_euclid(4.0) as usize {
            // A quarter turn takes (x, y) to (-y, x).
            corner = [-corner[1] - sheet.height as f64, corner[0]];
            sheet = quarter(&sheet);
        }
        return (sheet, corner);
    }
    askew(&sheet, yaw)
}

/// Width and height of the turned cells, in cells, to see beforehand whether they can be handled.
pub(super) fn size(width: usize, height: usize, yaw: f64) -> [i64; 2] {
    let (sin, cos) = real::sin_cos(yaw);
    let along = |a: f64, b: f64| (width as f64 * a.abs() + height as f64 * b.abs()).ceil() as i64 + 1;
    [along(cos, sin), along(sin, cos)]
}

fn quarter(sheet: &Sheet) -> Sheet {
    let (width, height) = (sheet.height, sheet.width);
    let at = |i: usize, j: usize| sheet.cells[(sheet.height - 1 - i) * sheet.width + j];
    let cells = (0..height).flat_map(|j| (0..width).map(move |i| at(i, j))).collect();
    Sheet { width, height, cells }
}

fn askew(sheet: &Sheet, yaw: f64) -> (Sheet, [f64; 2]) {
    let (sin, cos) = real::sin_cos(yaw);
    let (w, h) = (sheet.width as f64, sheet.height as f64);
    let turned = |x: f64, y: f64| [cos * x - sin * y, sin * x + cos * y];
    let corners = [turned(0.0, 0.0), turned(w, 0.0), turned(0.0, h), turned(w, h)];
    let low = [0, 1].map(|a| corners.iter().map(|c| c[a]).fold(f64::INFINITY, f64::min).floor());
    let high = [0, 1].map(|a| corners.iter().map(|c| c[a]).fold(f64::NEG_INFINITY, f64::max).ceil());
    let [width, height] = [0, 1].map(|a| (high[a] - low[a]) as usize);
    let mut cells = vec![Seen::Free; width * height];
    let beyond = |x: f64, y: f64| {
        let (u, v) = (cos * x + sin * y, cos * y - sin * x);
        u < -TOUCH || v < -TOUCH || u > w + TOUCH || v > h + TOUCH
    };
    for (at, cell) in cells.iter_mut().enumerate() {
        let [x, y] = [low[0] + (at % width) as f64, low[1] + (at / width) as f64];
        if [(x, y), (x + 1.0, y), (x, y + 1.0), (x + 1.0, y + 1.0)].iter().any(|(x, y)| beyond(*x, *y)) {
            *cell = Seen::Unknown;
        }
    }
    // Two squares of side 1 are apart where their shadows on a side's direction are: half of one is 0.5, of the other `half`.
    let half = 0.5 * (sin.abs() + cos.abs());
    for (at, seen) in sheet.cells.iter().enumerate().filter(|(_, seen)| **seen != Seen::Free) {
        let centre = turned((at % sheet.width) as f64 + 0.5, (at / sheet.width) as f64 + 0.5);
        let first = [0, 1].map(|a| (centre[a] - half - low[a]).floor().max(0.0) as usize);
        let last =
            [(0, width), (1, height)].map(|(a, n)| ((centre[a] + half - low[a]).ceil().max(0.0) as usize).min(n));
        for (i, j) in (first[0]..last[0]).flat_map(|i| (first[1]..last[1]).map(move |j| (i, j))) {
            let d = [low[0] + i as f64 + 0.5 - centre[0], low[1] + j as f64 + 0.5 - centre[1]];
            let shadows = [d[0], d[1], cos * d[0] + sin * d[1], cos * d[1] - sin * d[0]];
            if shadows.iter().all(|shadow| shadow.abs() < 0.5 + half - TOUCH) {
                let cell = &mut cells[j * width + i];
                // An obstacle hides what is unknown beside it.
                if *cell != Seen::Occupied {
                    *cell = *seen;
                }
            }
        }
    }
    (Sheet { width, height, cells }, low)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn sheet(width: usize, height: usize, codes: &[u8]) -> Sheet {
        let seen = |code: &u8| [Seen::Free, Seen::Unknown, Seen::Occupied][usize::from(*code) % 3];
        Sheet { width, height, cells: codes.iter().cycle().take(width * height).map(seen).collect() }
    }

    #[test]
    fn quarter_turns_take_pixels_to_cells() {
        let (turned, corner) = turn(sheet(3, 1, &[0, 1, 2]), FRAC_PI_2);
        assert_eq!((turned.width, turned.height, corner), (1, 3, [-1.0, 0.0]));
        assert!(turned.cells == [Seen::Free, Seen::Unknown, Seen::Occupied]);
        let (turned, corner) = turn(sheet(3, 1, &[0, 1, 2]), -FRAC_PI_2);
        assert_eq!((turned.width, turned.height, corner), (1, 3, [0.0, -3.0]));
        assert!(turned.cells == [Seen::Occupied, Seen::Unknown, Seen::Free]);
        let (turned, corner) = turn(sheet(3, 2, &[0, 1, 2, 0, 0, 2]), 2.0 * FRAC_PI_2);
        assert_eq!((turned.width, turned.height, corner), (3, 2, [-3.0, -2.0]));
        assert!(turned.cells == sheet(3, 2, &[2, 0, 0, 2, 1, 0]).cells);
    }

    proptest! {
        #[test]
        fn every_point_of_a_pixel_lies_in_a_cell_that_says_as_much(
            width in 1usize..7, height in 1usize..7, codes in prop::collection::vec(any::<u8>(), 1..40), yaw in -7.0..7.0f64,
            points in prop::collection::vec((0.001..0.999f64, 0.001..0.999f64), 20),
        ) {
            let (sin, cos) = real::sin_cos(yaw);
            let before = sheet(width, height, &codes);
            let (after, corner) = turn(sheet(width, height, &codes), yaw);
            let [most_x, most_y] = size(width, height, yaw);
            prop_assert!(after.width as i64 <= most_x && after.height as i64 <= most_y);
            for (x, y) in points {
                let (x, y) = (x * width as f64, y * height as f64);
                let pixel = before.cells[y as usize * width + x as usize];
                let [i, j] = [cos * x - sin * y - corner[0], sin * x + cos * y - corner[1]];
                prop_assert!(i >= 0.0 && j >= 0.0 && (i as usize) < after.width && (j as usize) < after.height);
                // Within rounding of a border any of both is right.
                if [i, j].iter().any(|c| (c - c.round()).abs() < 1e-5) {
                    continue;
                }
                let cell = after.cells[j as usize * after.width + i as usize];
                prop_assert!(cell as u8 >= pixel as u8);
            }
            // And no more: a cell's obstacle has a pixel nearer than both half diagonals.
            let solid = |(at, _): &(usize, &Seen)| {
                let [x, y] = [(at % width) as f64 + 0.5, (at / width) as f64 + 0.5];
                [cos * x - sin * y - corner[0], sin * x + cos * y - corner[1]]
            };
            let solids: Vec<[f64; 2]> =
                before.cells.iter().enumerate().filter(|(_, s)| **s == Seen::Occupied).map(|p| solid(&p)).collect();
            for (at, _) in after.cells.iter().enumerate().filter(|(_, s)| **s == Seen::Occupied) {
                let [x, y] = [(at % after.width) as f64 + 0.5, (at / after.width) as f64 + 0.5];
                prop_assert!(solids.iter().any(|s| real::hypot(s[0] - x, s[1] - y) < 2f64.sqrt()));
            }
        }
    }
}
