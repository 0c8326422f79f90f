//! Walls, floating boxes and tables that do not overlap; lengths in cells of 5 cm.

use super::super::generate::CellBox;
use super::super::rng::Rng;
use super::{HEIGHT, Kind, SIDE};

/// Of each kind of obstacle in a room.
const WALLS: usize = 80;
const FLOATING: usize = 80;
const TABLES: usize = 40;
/// Tries to place one obstacle, before the room is drawn anew.
const TRIES: usize = 1000;

/// The obstacles of a room; `None`: too full.
pub(super) fn draw(rng: &mut Rng, kind: Kind) -> Option<Vec<CellBox>> {
    let makers: [(usize, Maker); 2] = match kind {
        Kind::Cuboids => [(WALLS, wall), (FLOATING, floating)],
        Kind::Tables => [(TABLES, tables), (WALLS, wall)],
    };
    let (mut placed, mut taken): (Vec<CellBox>, Vec<CellBox>) = (Vec::new(), Vec::new());
    for (count, maker) in makers {
        for _ in 0..count {
            let apart = |piece: &Piece| !taken.iter().any(|t| overlap(t, &piece.whole));
            let piece = (0..TRIES).map(|_| maker(rng)).find(apart)?;
            placed.extend(piece.parts);
            taken.push(piece.whole);
        }
    }
    Some(placed)
}

/// Draws an obstacle somewhere.
type Maker = fn(&mut Rng) -> Piece;

/// An obstacle: what it is made of, and the box that others keep out of.
struct Piece {
    parts: Vec<CellBox>,
    whole: CellBox,
}

impl Piece {
    /// One box of this size, beginning at this height, anywhere in the room.
    fn single(rng: &mut Rng, size: [i32; 3], bottom: i32) -> Self {
        let whole = anywhere(rng, size, bottom);
        Self { parts: vec![whole], whole }
    }
}

fn anywhere(rng: &mut Rng, [w, d, h]: [i32; 3], bottom: i32) -> CellBox {
    let [x, y] = [w, d].map(|s| rng.integer(0, SIDE - s));
    CellBox { min: [x, y, bottom], max: [x + w, y + d, bottom + h] }
}

/// 0.2 to 1.0 m along each side, 0.5 m to the room's height tall.
fn wall(rng: &mut Rng) -> Piece {
    let size = [rng.integer(4, 20), rng.integer(4, 20), rng.integer(10, HEIGHT)];
    Piece::single(rng, size, 0)
}

/// 0.2 to 0.8 m along each side, beginning at 0.45 to 1.2 m.
fn floating(rng: &mut Rng) -> Piece {
    let bottom = rng.integer(9, 24);
    let [w, d, h] = [0, 1, 2].map(|_| rng.integer(4, 16));
    Piece::single(rng, [w, d, h.min(HEIGHT - bottom)], bottom)
}

/// One to four equal tables side by side: each four legs and a top.
fn tables(rng: &mut Rng) -> Piece {
    const THICK: i32 = 1;
    let [w, d, h] = [rng.integer(15, 25), rng.integer(15, 30), rng.integer(15, 30)];
    let (w, d) = if rng.integer(0, 1) == 0 { (w, d) } else { (d, w) };
    let [columns, rows] = [0, 1].map(|_| rng.integer(1, 2));
    let whole = anywhere(rng, [columns * w, rows * d, h + THICK], 0);
    let mut parts = Vec::new();
    for k in 0..columns * rows {
        let [x, y] = [whole.min[0] + k % columns * w, whole.min[1] + k / columns * d];
        for (left, front) in [(x, y), (x + w - THICK, y), (x, y + d - THICK), (x + w - THICK, y + d - THICK)] {
            parts.push(CellBox { min: [left, front, 0], max: [left + THICK, front + THICK, h] });
        }
        parts.push(CellBox { min: [x, y, h], max: [x + w, y + d, h + THICK] });
    }
    Piece { parts, whole }
}

/// Whether two boxes share space. Touching faces do not.
pub(super) fn overlap(a: &CellBox, b: &CellBox) -> bool {
    (0..3).all(|i| a.min[i] < b.max[i] && b.min[i] < a.max[i])
}
