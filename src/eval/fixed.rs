//! The scenes of \[SCR\] Fig. 5 and 6, each one fixed room. The paper shows pictures of its own and gives no coordinates.

use super::Suite;
use super::generate::CellBox;

/// A room with its obstacles, start and goal: lengths in cells of 5 cm, headings in degrees.
pub(super) struct Fixed {
    /// Along x, y, z.
    pub room: [i32; 3],
    pub boxes: Vec<CellBox>,
    /// x, y, yaw.
    pub start: [f64; 3],
    /// x, y, yaw.
    pub goal: [f64; 3],
    /// Position of the blades at the start, for the robot that has them.
    pub blade: Option<f64>,
}

/// The scene of a figure; `None` for suites that are drawn from a seed.
pub(super) fn scene(suite: Suite) -> Option<Fixed> {
    match suite {
        Suite::Fig5 => Some(dense()),
        Suite::Fig6 => Some(bridges()),
        _ => None,
    }
}

/// Fig. 5: boxes of 60 cm with lanes of 50 cm between them. A box of 40 cm drives straight there and turns only where two lanes
/// cross: everywhere else its corners would touch. Smaller boxes close lanes so that the way turns at every second crossing.
fn dense() -> Fixed {
    // Of a box, and between two.
    const EDGE: i32 = 12;
    const LANE: i32 = 10;
    /// From a box to the next.
    const PITCH: i32 = EDGE + LANE;
    /// Boxes along a side.
    const ALONG: i32 = 5;
    /// Lanes closed between two crossings. Lanes along x: (crossing on the left, lane) from 0; the closing box stands in the
    /// middle, so that one can still turn at the crossings.
    const CLOSED_ALONG_X: [[i32; 2]; 7] = [[1, 0], [2, 0], [0, 1], [1, 1], [1, 2], [2, 2], [2, 3]];
    /// Lanes along y: (lane, crossing below).
    const CLOSED_ALONG_Y: [[i32; 2]; 3] = [[0, 0], [0, 1], [1, 2]];
    let of = |x: i32, y: i32, [w, d]: [i32; 2]| CellBox { min: [x, y, 0], max: [x + w, y + d, 8] };
    let boxes = (0..ALONG * ALONG).map(|k| of(k % ALONG * PITCH, k / ALONG * PITCH, [EDGE; 2]));
    let lane = |k: i32| EDGE + k * PITCH;
    let middle = |k: i32| PITCH * (k + 1) + 3;
    let along_x = CLOSED_ALONG_X.map(|[left, at]| of(middle(left), lane(at), [6, LANE]));
    let along_y = CLOSED_ALONG_Y.map(|[at, below]| of(lane(at), middle(below), [LANE, 6]));
    let side = ALONG * PITCH - LANE;
    Fixed {
        room: [side, side, 8],
        boxes: boxes.chain(along_x).chain(along_y).collect(),
        start: [17.0, 17.0, 180.0],
        goal: [83.0, 83.0, -90.0],
        blade: None,
    }
}

/// Fig. 6: two arch bridges in walls, so that the way leads under both: the first 1.00 x 0.45 m, to be passed with the blades
/// lying to the sides, the second 0.60 x 0.90 m, to be passed with the blades upright.
fn bridges() -> Fixed {
    /// Width of the room, cells.
    const WIDTH: i32 = 72;
    let bridge = |x: i32, y: i32, [width, height]: [i32; 2], lintel: i32| {
        let (pillar, depth, top) = (4, 12, height + lintel);
        let part = |y: [i32; 2], z: [i32; 2]| CellBox { min: [x, y[0], z[0]], max: [x + depth, y[1], z[1]] };
        let wall = |y: [i32; 2]| CellBox { min: [x + 4, y[0], 0], max: [x + 8, y[1], 14] };
        let end = y + 2 * pillar + width;
        [
            part([y, y + pillar], [0, top]),
            part([end - pillar, end], [0, top]),
            part([y + pillar, end - pillar], [height, top]),
            wall([0, y]),
            wall([end, WIDTH]),
        ]
    };
    let cube = |x: i32, y: i32, edge: i32| CellBox { min: [x, y, 0], max: [x + edge, y + edge, edge] };
    let cubes = [cube(20, 10, 12), cube(70, 46, 12), cube(84, 16, 8), cube(140, 44, 12)];
    Fixed {
        room: [170, WIDTH, 20],
        boxes: bridge(46, 36, [20, 9], 5).into_iter().chain(bridge(108, 14, [12, 18], 2)).chain(cubes).collect(),
        start: [14.0, 40.0, 0.0],
        goal: [154.0, 30.0, 0.0],
        blade: Some(0.0),
    }
}
