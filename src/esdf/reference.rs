//! The exact distance transform, plain: what tests and the benchmark compare `transform` with. One pass per axis, each
//! O(nodes) (Felzenszwalb & Huttenlocher 2012, cited by \[SCR\] as [22]).

use super::FAR;
use crate::map::VoxelMap;
use crate::mission::Unknown;

/// Squared distance, in cells, of a node with no site on its line yet. Small enough to add squares to without overflow.
const NONE: i32 = i32::MAX / 4;

/// Signed distances (m) at all nodes.
pub(super) fn signed_distance(map: &VoxelMap, nodes: [usize; 3]) -> Vec<f32> {
    let count = nodes[0] * nodes[1] * nodes[2];
    let mut outside = vec![NONE; count];
    let mut inside = Vec::new(); // made when the first node inside a solid is met
    columns(map, nodes, &mut outside, &mut inside);
    sweep_y_and_x(&mut outside, nodes);
    if !inside.is_empty() {
        sweep_y_and_x(&mut inside, nodes);
    }
    let metres = |squared: i32| if squared >= NONE { FAR } else { (f64::from(squared).sqrt() * map.resolution) as f32 };
    let mut values: Vec<f32> = outside.iter().map(|d| metres(*d)).collect();
    if !inside.is_empty() {
        for (value, depth) in values.iter_mut().zip(&inside) {
            if *depth > 0 {
                *value -= metres(*depth);
            }
        }
    }
    if map.outside == Unknown::Occupied {
        bound_by_edges(map.resolution, nodes, &mut values);
    }
    values
}

/// First pass, along z: squared distance to the nearest site in the same column. Sites of `outside` are the corners of
/// occupied cells; of `inside` the corners of free ones (space above and below the grid is free).
fn columns(map: &VoxelMap, nodes: [usize; 3], outside: &mut [i32], inside: &mut Vec<i32>) {
    let [nx, ny, nz] = nodes;
    let words = map.dims[2].div_ceil(64);
    let mut any = vec![0u64; words]; // occupied in at least one of the four columns around the node
    let mut all = vec![0u64; words]; // occupied in all four
    let free_beyond = map.outside == Unknown::Free;
    for i in 0..nx {
        for j in 0..ny {
            any.fill(0);
            all.fill(u64::MAX);
            for (a, b) in [(1, 1), (1, 0), (0, 1), (0, 0)] {
                if i < a || j < b || i - a >= map.dims[0] || j - b >= map.dims[1] {
                    if free_beyond {
                        all.fill(0);
                    }
                    continue;
                }
                for (w, bits) in map.column(i - a, j - b).iter().enumerate() {
                    any[w] |= bits;
                    all[w] &= bits;
                }
            }
            let at = (i * ny + j) * nz;
            if any.iter().any(|w| *w != 0) {
                line_of_bits(&mut outside[at..at + nz], |k| bit(&any, k) || (k > 0 && bit(&any, k - 1)));
            }
            let solid = |k: usize| k < map.dims[2] && bit(&all, k);
            if (1..nz).any(|k| solid(k) && solid(k - 1)) {
                if inside.is_empty() {
                    inside.resize(outside.len(), 0);
                }
                line_of_bits(&mut inside[at..at + nz], |k| !(k > 0 && solid(k) && solid(k - 1)));
            }
        }
    }
}

fn bit(words: &[u64], k: usize) -> bool {
    words.get(k / 64).is_some_and(|w| w >> (k % 64) & 1 == 1)
}

/// Squared distance along one line to the nearest site.
fn line_of_bits(line: &mut [i32], site: impl Fn(usize) -> bool) {
    let mut distance = i32::MAX;
    for (k, value) in line.iter_mut().enumerate() {
        distance = if site(k) { 0 } else { distance.saturating_add(1) };
        *value = distance;
    }
    distance = i32::MAX;
    for value in line.iter_mut().rev() {
        distance = if *value == 0 { 0 } else { distance.saturating_add(1) };
        let nearest = (*value).min(distance);
        *value = if nearest < 1 << 14 { nearest * nearest } else { NONE };
    }
}

/// Second and third pass: lower envelopes of parabolas along y, then x.
fn sweep_y_and_x(field: &mut [i32], [nx, ny, nz]: [usize; 3]) {
    let mut envelope = Envelope::with_capacity(nx.max(ny));
    for i in 0..nx {
        for k in 0..nz {
            envelope.line(field, i * ny * nz + k, nz, ny);
        }
    }
    for j in 0..ny {
        for k in 0..nz {
            envelope.line(field, j * nz + k, ny * nz, nx);
        }
    }
}

/// Scratch memory of one lower envelope.
struct Envelope {
    /// Position and height of each parabola on the envelope.
    parabolas: Vec<(i32, i32)>,
    /// Parabola m rules from `from[m]` on.
    from: Vec<i32>,
}

impl Envelope {
    fn with_capacity(n: usize) -> Self {
        Self { parabolas: Vec::with_capacity(n), from: Vec::with_capacity(n) }
    }

    /// Replaces a line (first index, stride, length) by `min over m of (k - m)^2 + line[m]`.
    fn line(&mut self, field: &mut [i32], first: usize, stride: usize, length: usize) {
        self.parabolas.clear();
        self.from.clear();
        for m in 0..length {
            let height = field[first + m * stride];
            if height < NONE {
                self.add(m as i32, height, length as i32);
            }
        }
        if self.parabolas.is_empty() || (self.parabolas.len() == length && self.parabolas.iter().all(|p| p.1 == 0)) {
            return;
        }
        for m in 0..self.parabolas.len() {
            let (at, height) = self.parabolas[m];
            let end = self.from.get(m + 1).copied().unwrap_or(length as i32);
            for k in self.from[m]..end {
                field[first + k as usize * stride] = height + (k - at) * (k - at);
            }
        }
    }

    fn add(&mut self, at: i32, height: i32, length: i32) {
        loop {
            let Some(&(last, last_height)) = self.parabolas.last() else {
                self.parabolas.push((at, height));
                self.from.push(0);
                return;
            };
            // The first k at which the new parabola is strictly lower than the last one.
            let numerator = i64::from(height) + i64::from(at) * i64::from(at)
                - i64::from(last_height)
                - i64::from(last) * i64::from(last);
            let start = numerator.div_euclid(2 * i64::from(at - last)) + 1;
            let rules_from = *self.from.last().expect("one entry a parabola");
            if start <= i64::from(rules_from) {
                self.parabolas.pop();
                self.from.pop();
                continue;
            }
            if start < i64::from(length) {
                self.parabolas.push((at, height));
                self.from.push(start as i32);
            }
            return;
        }
    }
}

/// The grid's edges in x and y are walls.
fn bound_by_edges(resolution: f64, [nx, ny, nz]: [usize; 3], values: &mut [f32]) {
    for i in 0..nx {
        for j in 0..ny {
            let cells = i.min(nx - 1 - i).min(j).min(ny - 1 - j);
            let edge = (cells as f64 * resolution) as f32;
            for value in &mut values[(i * ny + j) * nz..][..nz] {
                *value = value.min(edge);
            }
        }
    }
}
