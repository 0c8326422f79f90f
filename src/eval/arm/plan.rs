//! Where the base alone can be and go, seen from above.

use super::super::generate::{CELL, CellBox, metres};
use super::SIDE;
use crate::math::real;

/// Cells whose middle a disc's centre may be at, and which of them are joined.
pub(super) struct Plan {
    /// Per cell: 0 where the disc does not fit, else a number that all cells share that it gets to from there.
    region: Vec<u32>,
}

impl Plan {
    /// Of a disc of this radius (m) among the boxes that begin below this height (m), and within the room's walls.
    pub fn new(boxes: &[CellBox], height: f64, radius: f64) -> Self {
        const FREE: u32 = u32::MAX;
        let mut region = vec![FREE; (SIDE * SIDE) as usize];
        let wide = (radius / CELL).ceil() as i32;
        let middle = |c: i32| (f64::from(c) + 0.5) * CELL;
        for c in 0..SIDE {
            if middle(c.min(SIDE - 1 - c)) < radius {
                (0..SIDE).for_each(|d| [index([c, d]), index([d, c])].into_iter().for_each(|i| region[i] = 0));
            }
        }
        for b in boxes.iter().filter(|b| metres(b.min[2]) < height) {
            let gap =
                |axis: usize, c: i32| (metres(b.min[axis]) - middle(c)).max(middle(c) - metres(b.max[axis])).max(0.0);
            let range = |axis: usize| (b.min[axis] - wide - 1).max(0)..(b.max[axis] + wide + 1).min(SIDE);
            for i in range(0) {
                range(1)
                    .filter(|j| real::hypot(gap(0, i), gap(1, *j)) < radius)
                    .for_each(|j| region[index([i, j])] = 0);
            }
        }
        let mut plan = Self { region };
        let mut number = 0;
        for cell in 0..SIDE * SIDE {
            if plan.region[cell as usize] == FREE {
                number += 1;
                plan.flood([cell / SIDE, cell % SIDE], FREE, number);
            }
        }
        plan
    }

    fn flood(&mut self, from: [i32; 2], old: u32, new: u32) {
        let mut open = vec![from];
        self.region[index(from)] = new;
        while let Some([i, j]) = open.pop() {
            for (di, dj) in [(-1, -1), (-1, 0), (-1, 1), (0, -1), (0, 1), (1, -1), (1, 0), (1, 1)] {
                let next = [i + di, j + dj];
                if next.iter().all(|c| (0..SIDE).contains(c)) && self.region[index(next)] == old {
                    self.region[index(next)] = new;
                    open.push(next);
                }
            }
        }
    }

    /// Whether the disc fits at both places and gets from one to the other, from cell to cell.
    pub fn connected(&self, ends: [[f64; 2]; 2]) -> bool {
        let [from, to] = ends.map(|p| self.region[index(p.map(|c| ((c / CELL) as i32).clamp(0, SIDE - 1)))]);
        from == to && from != 0
    }
}

fn index([i, j]: [i32; 2]) -> usize {
    (i * SIDE + j) as usize
}
