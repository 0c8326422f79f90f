//! Where each unknown lives, and how a piece's own coordinates become unknowns.

use super::hermite::{DATA, ORDERS};

/// Dimension of the heading.
pub(super) const HEADING: usize = 0;
/// Dimension of the arc length.
pub(super) const ARC: usize = 1;

/// Unknowns node by node: `dimension * 3 + order`, then x, y, then the logarithm of the duration of the piece that begins there.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Layout {
    /// Heading, arc length, joints.
    pub dimensions: usize,
    /// At least 1.
    pub pieces: usize,
}

impl Layout {
    /// Unknowns of a node.
    pub fn block(self) -> usize {
        ORDERS * self.dimensions + 3
    }

    /// Unknowns in all.
    pub fn size(self) -> usize {
        (self.pieces + 1) * self.block()
    }

    /// Furthest that two unknowns of one piece are apart.
    pub fn width(self) -> usize {
        2 * self.block() - 2
    }

    /// Index of a node's value or derivative.
    pub fn state(self, node: usize, dimension: usize, order: usize) -> usize {
        node * self.block() + ORDERS * dimension + order
    }

    /// Index of a node's x; y follows.
    pub fn position(self, node: usize) -> usize {
        node * self.block() + ORDERS * self.dimensions
    }

    /// Index of the logarithm of a piece's duration.
    pub fn duration(self, piece: usize) -> usize {
        piece * self.block() + ORDERS * self.dimensions + 2
    }

    /// A piece's data in unit time, for its duration.
    pub fn data(self, piece: usize, dimension: usize, x: &[f64], time: f64) -> [f64; DATA] {
        let (from, to) = (self.state(piece, dimension, 0), self.state(piece + 1, dimension, 0));
        let square = time * time;
        [x[from], x[from + 1] * time, x[from + 2] * square, x[to], x[to + 1] * time, x[to + 2] * square]
    }

    /// Coordinates of a piece: six data in unit time a dimension, logarithm of the duration, both ends' positions.
    pub fn local_size(self) -> usize {
        DATA * self.dimensions + 5
    }

    /// Local index of the logarithm of the duration; the start's x follows, then its y, then the end's x and y.
    pub fn local_time(self) -> usize {
        DATA * self.dimensions
    }

    /// Of each local coordinate, its unknown's index less that of the piece's first unknown.
    pub fn offsets(self) -> Vec<usize> {
        let block = self.block();
        let data = (0..DATA * self.dimensions).map(|i| (i % DATA) / ORDERS * block + ORDERS * (i / DATA) + i % ORDERS);
        let start = ORDERS * self.dimensions;
        data.chain([start + 2, start, start + 1, block + start, block + start + 1]).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_local_coordinate_is_an_unknown_of_its_own_within_the_band() {
        for dimensions in 2..6 {
            let layout = Layout { dimensions, pieces: 3 };
            let offsets = layout.offsets();
            assert_eq!(offsets.len(), layout.local_size());
            let mut sorted = offsets.clone();
            sorted.sort_unstable();
            sorted.dedup();
            assert_eq!(sorted.len(), offsets.len());
            assert_eq!(sorted[sorted.len() - 1] - sorted[0], layout.width());
            assert_eq!(offsets[layout.local_time()], layout.duration(0));
            assert_eq!(offsets[layout.local_time() + 3], layout.position(1));
            assert_eq!(offsets[DATA + 4], layout.state(1, ARC, 1));
        }
    }
}
