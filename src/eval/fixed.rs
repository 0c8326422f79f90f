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

/// Fig. 5: rows of boxes of 60 cm, each row with one gap that a box of 40 cm passes, lanes of about 70 cm between them: the way
/// leads around a dozen corners, and start and goal face walls.
fn dense() -> Fixed {
    /// Lower edge of a row, and the left edges of its boxes with how far each is moved up.
    type Row = (i32, [(i32, i32); 8]);
    const ROWS: [Row; 4] = [
        (15, [(0, 0), (13, 1), (26, 0), (39, 0), (52, 1), (65, 0), (93, 0), (108, 1)]),
        (43, [(0, 0), (28, 1), (41, 0), (54, 0), (68, 1), (81, 0), (94, 0), (107, 0)]),
        (71, [(1, 0), (14, 1), (27, 0), (40, 1), (53, 0), (66, 0), (79, 1), (107, 0)]),
        (99, [(0, 1), (13, 0), (26, 0), (54, 1), (67, 0), (80, 0), (94, 0), (107, 1)]),
    ];
    let row = |(y, boxes): Row| {
        boxes.map(|(x, up)| CellBox { min: [x, y + up, 0], max: [x + 12, y + up + 12, 8] })
    };
    Fixed {
        room: [120, 127, 8],
        boxes: ROWS.into_iter().flat_map(row).collect(),
        start: [7.0, 7.0, 180.0],
        goal: [8.0, 120.0, -90.0],
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
