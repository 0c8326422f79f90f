//! Makes the maps that this project draws itself: `cargo run --example generate_maps` writes them into `maps/`.
//!
//! Lengths are counted in cells of 5 cm, so that every face lies on the voxel grid and every point in the middle of a cell:
//! points on faces would fall into the neighbours. A test of the library compares the files with what is made here.

/// Cells along each side of the hall: 10 m.
const SIDE: u32 = 200;
/// Cell size, m.
const CELL: f64 = 0.05;

/// A block of cells: x, y and z from the first to before the second, in cells.
type Block = [[u32; 2]; 3];

/// A wall across the whole hall along x, broken by one arch bridge.
struct Wall {
    /// Where the arch's outer edge is.
    arch_x: u32,
    /// Front of the arch.
    arch_y: u32,
    /// Clear width and height of the opening.
    opening: [u32; 2],
    /// Thickness of what spans it.
    lintel: u32,
}

/// Width of an arch's pillars, 0.20 m.
const PILLAR: u32 = 4;
/// How deep an arch is, 0.60 m.
const DEPTH: u32 = 12;
/// Height of the walls, 0.70 m: above the robot's 0.63 m.
const WALL_HEIGHT: u32 = 14;

/// Low and wide, 1.00 x 0.45 m: to be passed with the blades lying to the sides.
const LOW: Wall = Wall { arch_x: 64, arch_y: 54, opening: [20, 9], lintel: 5 };
/// Narrow and tall, 0.60 x 0.90 m: to be passed with the blades upright.
const NARROW: Wall = Wall { arch_x: 100, arch_y: 116, opening: [12, 18], lintel: 2 };

/// Cubes: x, y of the corner and the edge, in cells; edges of 0.4, 0.6 and 0.8 m.
const CUBES: [[u32; 3]; 12] = [
    [30, 18, 12],
    [62, 8, 16],
    [110, 22, 16],
    [150, 30, 12],
    [172, 6, 8],
    [14, 36, 8],
    [40, 84, 16],
    [84, 82, 8],
    [134, 88, 16],
    [170, 74, 12],
    [134, 150, 16],
    [84, 152, 12],
];

impl Wall {
    /// Two pillars, the lintel, and the wall to both sides, 0.20 m thick, in the middle of the arch's depth.
    fn blocks(&self) -> [Block; 5] {
        let [width, height] = self.opening;
        let (x, y) = (self.arch_x, [self.arch_y, self.arch_y + DEPTH]);
        let top = height + self.lintel;
        let end = x + 2 * PILLAR + width;
        let wall = [self.arch_y + DEPTH / 2 - 2, self.arch_y + DEPTH / 2 + 2];
        [
            [[x, x + PILLAR], y, [0, top]],
            [[x + PILLAR + width, end], y, [0, top]],
            [[x + PILLAR, x + PILLAR + width], y, [height, top]],
            [[0, x], wall, [0, WALL_HEIGHT]],
            [[end, SIDE], wall, [0, WALL_HEIGHT]],
        ]
    }
}

/// Middle of a cell, m.
fn middle(cell: u32) -> f64 {
    (f64::from(cell) + 0.5) * CELL
}

/// `maps/arch_bridges.pcd`: a hall of 10 x 10 m with two walls. The only way through the first is a low arch bridge, through
/// the second a narrow one. Floor points (z = 0) lie on every second cell, so that the whole floor is seen space.
pub fn arch_bridges() -> Vec<u8> {
    let mut points: Vec<[f64; 3]> = Vec::new();
    let last = SIDE - 1;
    let every_second = || (0..SIDE).step_by(2).chain([last]);
    points.extend(every_second().flat_map(|i| every_second().map(move |j| [middle(i), middle(j), 0.0])));
    let cubes = CUBES.map(|[x, y, edge]| [[x, x + edge], [y, y + edge], [0, edge]]);
    for [x, y, z] in LOW.blocks().into_iter().chain(NARROW.blocks()).chain(cubes) {
        for i in x[0]..x[1] {
            for j in y[0]..y[1] {
                points.extend((z[0]..z[1]).map(|k| [middle(i), middle(j), middle(k)]));
            }
        }
    }
    let n = points.len();
    let mut file = format!(
        "# .PCD v0.7 - Point Cloud Data file format\n# two arch bridges; made by examples/generate_maps.rs\nVERSION 0.7\n\
         FIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nCOUNT 1 1 1\nWIDTH {n}\nHEIGHT 1\nVIEWPOINT 0 0 0 1 0 0 0\nPOINTS {n}\n\
         DATA binary\n"
    )
    .into_bytes();
    file.extend(points.iter().flatten().flat_map(|c| (*c as f32).to_le_bytes()));
    file
}

/// `maps/first.csv`: a floor of 4 x 3 m and a post of 0.2 x 0.2 x 0.4 m in its middle, as a table of points.
pub fn first() -> Vec<u8> {
    let mut text = String::from("# a floor of 4 x 3 m with a post; made by examples/generate_maps.rs\nx_m,y_m,z_m\n");
    let mut row = |i: u32, j: u32, z: f64| text += &format!("{:.3},{:.3},{z:.3}\n", middle(i), middle(j));
    for i in (0..80).step_by(8).chain([79]) {
        for j in (0..60).step_by(8).chain([59]) {
            row(i, j, 0.0);
        }
    }
    for i in 38..42 {
        for j in 28..32 {
            (0..8).for_each(|k| row(i, j, middle(k)));
        }
    }
    text.into_bytes()
}

/// The site's sides, cells: 5 x 6 m.
const SITE: [u32; 2] = [100, 120];
/// Boxes of the site: x, y of the corner and the edge, in cells. Two rows across the site have
/// one gap of 0.5 m each and at most 0.1 m elsewhere.
const BOXES: [[u32; 3]; 25] = [
    [42, 5, 8],
    [88, 6, 10],
    [0, 24, 12],
    [13, 24, 12],
    [26, 24, 12],
    [40, 24, 12],
    [54, 24, 12],
    [76, 24, 12],
    [88, 24, 12],
    [12, 38, 8],
    [84, 39, 8],
    [6, 64, 10],
    [24, 61, 10],
    [56, 60, 12],
    [86, 62, 10],
    [0, 82, 10],
    [12, 82, 10],
    [24, 82, 10],
    [44, 82, 10],
    [55, 82, 10],
    [66, 82, 10],
    [78, 82, 10],
    [90, 82, 10],
    [16, 106, 8],
    [82, 94, 8],
];
/// Tapes of the site, one cell thick: across the whole site along x, 0.45 m above the floor; and along y behind the second row, 0.40 m
/// above the floor.
const TAPES: [Block; 2] = [[[0, 100], [52, 53], [9, 10]], [[60, 61], [92, 120], [8, 9]]];

/// `maps/site.ply`: like the site of \[SCR\] section VI-C, of which the paper states size and kind: 5 x 6 m, square obstacles, and tapes
/// that limit the height. Floor points (z = 0) on every fourth cell.
pub fn site() -> Vec<u8> {
    let mut points: Vec<[f64; 3]> = Vec::new();
    let every_fourth = |cells: u32| (0..cells).step_by(4).chain([cells - 1]);
    points.extend(every_fourth(SITE[0]).flat_map(|i| every_fourth(SITE[1]).map(move |j| [middle(i), middle(j), 0.0])));
    let boxes = BOXES.map(|[x, y, edge]| [[x, x + edge], [y, y + edge], [0, edge]]);
    for [x, y, z] in boxes.into_iter().chain(TAPES) {
        for i in x[0]..x[1] {
            for j in y[0]..y[1] {
                points.extend((z[0]..z[1]).map(|k| [middle(i), middle(j), middle(k)]));
            }
        }
    }
    ply("a site of 5 x 6 m with boxes and tapes", &points)
}

/// The home's sides, cells: 6 x 5 m.
const HOME: [u32; 2] = [120, 100];
/// The wall between the home's two rooms, 1.5 m high and one cell thick; two ways through it: a tall gap of 0.85 m, and a door of 1.20 m
/// under a lintel at 1.25 m.
const PARTITION: [Block; 4] = [
    [[0, 17], [50, 51], [0, 30]],
    [[34, 60], [50, 51], [0, 30]],
    [[84, 120], [50, 51], [0, 30]],
    [[60, 84], [50, 51], [25, 30]],
];
/// A shelf along the northern wall, 0.4 m deep: two boards and two sides. 0.35 m is left between the boards, from 0.30 to 0.65 m.
const SHELF: [Block; 4] = [
    [[30, 66], [92, 100], [5, 6]],
    [[30, 66], [92, 100], [13, 14]],
    [[29, 30], [92, 100], [0, 14]],
    [[66, 67], [92, 100], [0, 14]],
];

/// `maps/home.ply`: two rooms for tall robots with arms and lifts. Floor points (z = 0) on every fourth cell.
pub fn home() -> Vec<u8> {
    let mut points: Vec<[f64; 3]> = Vec::new();
    let every_fourth = |cells: u32| (0..cells).step_by(4).chain([cells - 1]);
    points.extend(every_fourth(HOME[0]).flat_map(|i| every_fourth(HOME[1]).map(move |j| [middle(i), middle(j), 0.0])));
    for [x, y, z] in PARTITION.into_iter().chain(SHELF) {
        for i in x[0]..x[1] {
            for j in y[0]..y[1] {
                points.extend((z[0]..z[1]).map(|k| [middle(i), middle(j), middle(k)]));
            }
        }
    }
    ply("a home of two rooms with a shelf", &points)
}

/// The kitchen's sides, cells: 5.5 x 4.5 m.
const KITCHEN: [u32; 2] = [110, 90];
/// The wall between the kitchen and the hall before it, 1.6 m high and 0.2 m thick, with a door of 1.05 m under a lintel at 1.20 m.
const DOOR: [Block; 3] = [[[0, 44], [42, 46], [0, 32]], [[65, 110], [42, 46], [0, 32]], [[44, 65], [42, 46], [24, 32]]];
/// A table, four legs and a top at 0.70 to 0.75 m, and a cupboard that hangs over its farther side: 0.35 m is left between them.
const TABLE: [Block; 6] = [
    [[70, 71], [70, 71], [0, 14]],
    [[99, 100], [70, 71], [0, 14]],
    [[70, 71], [85, 86], [0, 14]],
    [[99, 100], [85, 86], [0, 14]],
    [[70, 100], [70, 86], [14, 15]],
    [[70, 100], [76, 90], [22, 30]],
];

/// `maps/kitchen.ply`: a hall and a kitchen for a robot with an arm. The floor is there to be hit: a layer of cells below z = 0, whole, for
/// robots that keep off it.
pub fn kitchen() -> Vec<u8> {
    let mut points: Vec<[f64; 3]> = Vec::new();
    points.extend((0..KITCHEN[0]).flat_map(|i| (0..KITCHEN[1]).map(move |j| [middle(i), middle(j), -0.5 * CELL])));
    for [x, y, z] in DOOR.into_iter().chain(TABLE) {
        for i in x[0]..x[1] {
            for j in y[0]..y[1] {
                points.extend((z[0]..z[1]).map(|k| [middle(i), middle(j), middle(k)]));
            }
        }
    }
    ply("a hall and a kitchen with a table and a cupboard", &points)
}

/// Points as a binary PLY file.
fn ply(what: &str, points: &[[f64; 3]]) -> Vec<u8> {
    let mut file = format!(
        "ply\nformat binary_little_endian 1.0\ncomment {what}; made by examples/generate_maps.rs\n\
         element vertex {}\nproperty float x\nproperty float y\nproperty float z\nend_header\n",
        points.len()
    )
    .into_bytes();
    file.extend(points.iter().flatten().flat_map(|c| (*c as f32).to_le_bytes()));
    file
}

/// Everything, by file name.
pub fn all() -> [(&'static str, Vec<u8>); 5] {
    [
        ("arch_bridges.pcd", arch_bridges()),
        ("first.csv", first()),
        ("home.ply", home()),
        ("kitchen.ply", kitchen()),
        ("site.ply", site()),
    ]
}

#[allow(dead_code)] // not called where a test includes this file
fn main() -> std::io::Result<()> {
    let folder = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("maps");
    std::fs::create_dir_all(&folder)?;
    for (name, bytes) in all() {
        std::fs::write(folder.join(name), &bytes)?;
        println!("{}: {} bytes", folder.join(name).display(), bytes.len());
    }
    Ok(())
}
