//! Where a disc fits between boxes in a square room, seen from above.

use super::generate::{CELL, CellBox, SIDE};
use crate::math::real;

/// A square room with the boxes that matter at some height.
pub(super) struct Room<'a> {
    boxes: Vec<&'a CellBox>,
}

impl<'a> Room<'a> {
    /// A room where boxes that begin at or above `height` cells are passed under.
    pub fn new(boxes: &'a [CellBox], height: i32) -> Self {
        Self { boxes: boxes.iter().filter(|b| b.min[2] < height).collect() }
    }

    /// Distance from a point to the nearest box or wall, m.
    pub fn clearance(&self, [x, y]: [f64; 2]) -> f64 {
        let side = f64::from(SIDE) * CELL;
        let wall = x.min(y).min(side - x).min(side - y);
        let gap = |low: i32, high: i32, at: f64| {
            let (low, high) = (f64::from(low) * CELL, f64::from(high) * CELL);
            (low - at).max(at - high).max(0.0)
        };
        let nearest = self.boxes.iter().map(|b| real::hypot(gap(b.min[0], b.max[0], x), gap(b.min[1], b.max[1], y)));
        nearest.fold(wall, f64::min)
    }

    /// Whether a disc of this radius can be moved from one point to the other, from cell centre to cell centre.
    pub fn connected(&self, from: [f64; 2], to: [f64; 2], radius: f64) -> bool {
        let cell = |p: [f64; 2]| p.map(|c| ((c / CELL) as i32).clamp(0, SIDE - 1));
        let index = |[i, j]: [i32; 2]| (i * SIDE + j) as usize;
        let free = |[i, j]: [i32; 2]| self.clearance([i, j].map(|c| (f64::from(c) + 0.5) * CELL)) >= radius;
        let goal = cell(to);
        let mut seen = vec![false; (SIDE * SIDE) as usize];
        let mut open = vec![cell(from)];
        seen[index(cell(from))] = true;
        if !free(cell(from)) {
            return false;
        }
        while let Some([i, j]) = open.pop() {
            if [i, j] == goal {
                return true;
            }
            for (di, dj) in [(-1, -1), (-1, 0), (-1, 1), (0, -1), (0, 1), (1, -1), (1, 0), (1, 1)] {
                let next = [i + di, j + dj];
                if next.iter().all(|c| (0..SIDE).contains(c)) && !seen[index(next)] {
                    seen[index(next)] = true;
                    if free(next) {
                        open.push(next);
                    }
                }
            }
        }
        false
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A wall across the room with a door of 12 cells.
    fn wall() -> [CellBox; 2] {
        [CellBox { min: [0, 100, 0], max: [94, 104, 8] }, CellBox { min: [106, 100, 0], max: [200, 104, 8] }]
    }

    #[test]
    fn clearance_counts_walls_corners_and_not_what_hangs_above() {
        let boxes = [CellBox { min: [20, 20, 9], max: [40, 40, 10] }];
        assert!((Room::new(&boxes, 9).clearance([1.5, 1.5]) - 1.5).abs() < 1e-12, "passed under");
        let room = Room::new(&boxes, 10);
        assert_eq!(room.clearance([1.5, 1.5]), 0.0);
        assert!((room.clearance([2.3, 2.4]) - 0.5).abs() < 1e-12, "3, 4, 5 from the corner");
        assert!((room.clearance([9.9, 5.0]) - 0.1).abs() < 1e-12);
    }

    #[test]
    fn a_disc_passes_the_door_it_is_narrower_than() {
        let boxes = wall();
        let room = Room::new(&boxes, 8);
        let pass = |radius| room.connected([5.0, 2.0], [5.0, 8.0], radius);
        assert!(pass(0.27) && !pass(0.31));
        assert!(!room.connected([5.0, 5.1], [5.0, 8.0], 0.9), "starts too near");
        assert!(room.connected([5.0, 2.0], [5.0, 2.0], 0.5));
    }
}
