//! Why a map cannot be read.

use crate::diag::{Describe, Diagnostic, Span, suggestion};
use crate::memory::{self, TooMuch};

/// Endings that are read, for messages.
pub(super) const FORMATS: &str = "point clouds .pcd, .ply, .las, .laz, .xyz, .txt, .csv and .npy (N x 3); voxels .npy (3-D, boolean or \
                                  integer); octrees .bt and .ot; map_server .yaml with its .pgm";

/// Why a map cannot be read. The top of the stage adds the file's name where a variant has no place in a text.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub(super) enum MapError {
    /// The ending is not one of ours.
    #[error("cannot read maps {}", if ending.is_empty() { "without an ending".into() } else { format!("of format `{ending}`") })]
    Format { ending: String },
    /// An image was named where its YAML belongs.
    #[error("an image alone has no scale: expected the map_server .yaml that belongs to it")]
    ImageAlone { sheet: String },
    /// The first bytes are not the format's.
    #[error("this is no {format} file: it does not begin with {begin}")]
    NotThisFormat { format: &'static str, begin: &'static str },
    /// The header does not end.
    #[error("the {format} header has no `{last}` line, which ends it")]
    NoHeaderEnd { format: &'static str, last: &'static str },
    /// A word of the header that is not known.
    #[error("unknown line `{word}` in the {format} header")]
    UnknownHeaderLine { format: &'static str, word: String, nearest: Option<String>, at: Span },
    /// The header says the same thing twice.
    #[error("`{word}` is given twice in the header")]
    HeaderTwice { word: String, at: Span },
    /// A line that must be in the header is not.
    #[error("the {format} header has no `{word}` line")]
    HeaderMissing { format: &'static str, word: &'static str },
    /// A value in the header makes no sense.
    #[error("`{word}` is `{value}`: expected {expected}")]
    HeaderValue { word: String, value: String, expected: &'static str, at: Span },
    /// SIZE, TYPE or COUNT do not fit FIELDS.
    #[error("`{word}` has {got} values for {fields} fields")]
    HeaderLength { word: String, got: usize, fields: usize, at: Span },
    /// The organised size is not the number of points.
    #[error("the header contradicts itself: WIDTH {width} x HEIGHT {height}, but POINTS {points}")]
    PointsDiffer { width: u64, height: u64, points: u64, at: Span },
    /// A coordinate is not in the file.
    #[error("no column `{missing}`: the file has {found}")]
    NoCoordinate { missing: char, found: String, at: Option<Span> },
    /// The same of a table, whose header is this line.
    #[error("no column `{missing}`: the header has {found}")]
    NoColumn { missing: char, found: String, line: u64 },
    /// Fewer bytes than the header promises.
    #[error("truncated: {promised} {unit} promised ({promised_bytes} bytes), but only {have_bytes} bytes are there")]
    Truncated { unit: &'static str, promised: u128, promised_bytes: u128, have_bytes: u128 },
    /// More data than the header promises: points would be lost silently.
    #[error(
        "more data than the header promises: {promised} {unit} are {promised_bytes} bytes, but {have_bytes} are there"
    )]
    Surplus { unit: &'static str, promised: u128, promised_bytes: u128, have_bytes: u128 },
    /// The same for rows of text.
    #[error("{} {unit} promised, but {have} are there", promised)]
    RowsDiffer { unit: &'static str, promised: u64, have: u64 },
    /// A row with the wrong number of columns.
    #[error("`{text}` has {got} column{}, expected {expected}", if *.got == 1 { "" } else { "s" })]
    Columns { line: u64, got: usize, expected: String, text: String },
    /// A word that is not a number.
    #[error("{} is not a number", if word.is_empty() { "an empty cell".into() } else { format!("`{word}`") })]
    NotANumber { line: u64, word: String },
    /// A row that may have decimal commas.
    #[error("`{text}` has both commas and semicolons")]
    MixedSeparators { line: u64, text: String },
    /// An octree that ends within a node.
    #[error(
        "the tree is cut off at byte {at} of the file: a node needs {needs} bytes, {have} are left; {seen} of {promised} nodes read"
    )]
    TreeCut { at: usize, needs: usize, have: usize, seen: u64, promised: u64 },
    /// An octree with other nodes than its header promises, or with something behind it.
    #[error(
        "the tree ends at byte {at} of the file with {have} nodes and {left} bytes left over, but its header promises {promised} nodes"
    )]
    NodesDiffer { at: usize, promised: u64, have: u64, left: usize },
    /// Nodes below the smallest cell.
    #[error("the node at byte {at} of the file has children below level {depth}, the last of an octree")]
    TooDeep { at: usize, depth: u32 },
    /// A node's log-odds are no number.
    #[error("the node at byte {at} of the file has no occupancy: its log-odds are NaN")]
    NoOccupancy { at: usize },
    /// An octree without known space.
    #[error("no leaves: the octree is empty")]
    NoLeaves,
    /// A value of a LAS header that makes no sense.
    #[error("byte {at} of the LAS header: {what} is {found}, expected {expected}")]
    LasHeader { at: usize, what: &'static str, found: String, expected: String },
    /// LAZ, which this build does not unpack.
    #[error("the LAS file is compressed (LAZ), which this build does not unpack")]
    LazNotBuilt,
    /// LAZ that does not decode.
    #[cfg(feature = "laz")]
    #[error("the compressed points are damaged after {at} of {points}: {fault}")]
    LazDamaged { at: u64, points: u64, fault: String },
    /// Compressed data that does not decode.
    #[error("the compressed data is damaged at its byte {at}: {unpacked} of {expected} bytes unpacked")]
    Damaged { at: usize, unpacked: usize, expected: usize },
    /// The compressed block's size cannot be right.
    #[error("the compressed block says {said} bytes unpacked, but the header's points take {expected}")]
    UnpackedSize { said: u64, expected: u128 },
    /// Nothing to build a map from.
    #[error("no points: {}", if *points == 0 { "the file has none".into() } else { format!("the file has {points}, of which {not_finite} are not finite") })]
    NoPoints { points: usize, not_finite: usize },
    /// Coordinates that cannot be metres on a floor.
    #[error("coordinates reach {} m along {axis}: farther than {limit} m from the origin", short(*value))]
    FarAway { value: f64, axis: char, limit: f64 },
    /// The grid would not fit in memory.
    #[error("the grid would have {} x {} x {} cells of {resolution} m: more than can be handled", dims[0], dims[1], dims[2])]
    TooLarge { dims: [u64; 3], resolution: f64, enough: Option<f64> },
    /// Reading would take more memory than there may be used.
    #[error("{what} would take {fault}")]
    Memory { what: &'static str, fault: TooMuch },
    /// Not a cell size.
    #[error("a resolution of {value} m cannot be used")]
    Resolution { value: f64, at: Option<Span> },
    /// The mission's resolution is not the grid's own.
    #[error("the mission asks for cells of {asked} m, but the grid's own are {own} m")]
    ResolutionDiffers { asked: f64, own: f64 },
    /// Voxels of unknown size.
    #[error("the voxels' size is not known: `.npy` has no place for it")]
    NoResolution,
    /// `origin_m` where it has no meaning.
    #[error("`origin_m` is for voxel grids (.npy, 3-D): this map has its own coordinates")]
    OriginUnused,
    /// An origin that cannot be used.
    #[error("the origin {value:?} is not finite or farther than {limit} m")]
    Origin { value: Vec<f64>, limit: f64, at: Option<Span> },
    /// A box or bounds upside down, thinner than a cell, or not finite.
    #[error("a box from {:?} to {:?} is upside down, too thin for a grid, or farther than {limit} m", &corners[..3], &corners[3..])]
    Box { corners: Vec<f64>, limit: f64 },
    /// The slab is upside down or not finite.
    #[error("`height_m` [{low}, {high}] is no slab: expected [floor, ceiling], the lower first")]
    Slab { low: f64, high: f64 },
    /// NPY header that is not understood.
    #[error("the .npy header is not understood: {fault}")]
    NpyHeader { fault: String },
    /// A type that has no meaning here.
    #[error("the array is of type `{descr}`: expected {expected}")]
    NpyType { descr: String, expected: &'static str },
    /// A shape that has no meaning here.
    #[error("the array has shape {shape:?}: expected points N x 3 or voxels [ix, iy, iz]")]
    NpyShape { shape: Vec<u64> },
    /// JSON or YAML beside or instead of the map.
    #[error("cannot read the map's {what}: {fault}")]
    Description { what: &'static str, fault: String, at: Option<Span> },
    /// No mode of map_server's.
    #[error("map mode `{mode}` is none of trinary, scale, raw")]
    Mode { mode: String, at: Span },
    /// The image is not there.
    #[error("the image `{image}`, which the map names, is missing")]
    NoImage { image: String, at: Span },
    /// The image is no PGM.
    #[error("the map's image is {found}, not a PGM (P5 or P2)")]
    NotPgm { found: &'static str },
    /// PGM header that is not understood.
    #[error("the PGM header is not understood: expected {expected}, found `{found}`")]
    PgmHeader { expected: &'static str, found: String },
    /// A pixel lighter than white.
    #[error("pixel {index} is {value}, above the image's own maximum {max}")]
    Pixel { index: usize, value: u64, max: u32 },
}

/// Asks for memory.
pub(super) fn room(what: &'static str, bytes: u128) -> Result<(), MapError> {
    memory::fits(bytes).map_err(|fault| MapError::Memory { what, fault })
}

/// Digits that can be read: 1e300, not a one with 300 zeros.
fn short(value: f64) -> String {
    if value.abs() < 1e12 { value.to_string() } else { format!("{value:e}") }
}

impl MapError {
    /// What a fault in a row of text quotes, and the row's line, from 1.
    pub(super) fn row(&self) -> Option<(u64, &str)> {
        match self {
            Self::Columns { line, text, .. } | Self::MixedSeparators { line, text } => Some((*line, text)),
            Self::NotANumber { line, word } => Some((*line, word)),
            Self::NoColumn { line, .. } => Some((*line, "")),
            _ => None,
        }
    }
}

/// A good line of a header, or a good value of a map_server .yaml.
fn example(word: &str) -> &'static str {
    match word.split(' ').next().unwrap_or_default() {
        "VERSION" => "`VERSION 0.7`",
        "FIELDS" => "`FIELDS x y z`",
        "SIZE" | "TYPE" => "`SIZE 4 4 4` with `TYPE F F F`",
        "COUNT" => "`COUNT 1 1 1`: 1 for x, y and z each",
        "WIDTH" => "`WIDTH 1000` with `HEIGHT 1`",
        "HEIGHT" => "`HEIGHT 1`",
        "POINTS" => "`POINTS 1000`",
        "DATA" => "`DATA ascii`",
        "format" => "`format ascii 1.0` or `format binary_little_endian 1.0`",
        "element" => "`element vertex 1000`",
        "property" => "`property float x`",
        "res" => "`res 0.05`, in metres",
        "size" => "`size 1000`, the number of nodes",
        "id" => "`id OcTree`",
        "occupied_thresh" => "`occupied_thresh: 0.65`",
        "free_thresh" => "`free_thresh: 0.25`",
        _ => "what the tool writes that made the others",
    }
}

impl MapError {
    /// Whether it can only be about an occupancy map's image, where there is one.
    pub(super) fn is_of_pixels(&self) -> bool {
        use MapError::*;
        matches!(
            self,
            NotPgm { .. } | PgmHeader { .. } | Pixel { .. } | Truncated { .. } | Surplus { .. } | RowsDiffer { .. }
        )
    }
}

impl Describe for MapError {
    fn diagnostic(&self) -> Diagnostic {
        use MapError::*;
        let d = Diagnostic::error(self.code(), self);
        match self {
            Format { .. } => d.hint(format!("read are {FORMATS}")),
            LazNotBuilt => {
                d.hint("build with `cargo install --path . --features laz`, or unpack it: `pdal translate map.laz map.las`")
            }
            UnknownHeaderLine { format, nearest, at, .. } => d.at(at).hint(match nearest {
                Some(near) => format!("did you mean `{near}`?"),
                None if *format == "PCD" => "lines of a PCD header are VERSION, FIELDS, SIZE, TYPE, COUNT, WIDTH, HEIGHT, VIEWPOINT, POINTS, DATA".into(),
                None => "lines of a PLY header are format, comment, obj_info, element, property, end_header".into(),
            }),
            HeaderTwice { at, .. } => d.at(at).hint("keep one of the two lines, the one that is right"),
            HeaderValue { word, at, .. } => d.at(at).hint(format!("for example {}", example(word))),
            HeaderLength { fields, at, .. } => d.at(at).hint(format!("write {fields}, one for each field of FIELDS")),
            PointsDiffer { width, height, at, .. } => {
                d.at(at).hint(format!("write POINTS {}, or correct WIDTH and HEIGHT", u128::from(*width) * u128::from(*height)))
            }
            NoHeaderEnd { format: "PCD", .. } => {
                d.hint("the header's last line is DATA ascii, binary or binary_compressed: was the file cut off?")
            }
            NoHeaderEnd { .. } => d.hint("was the file cut off?"),
            HeaderMissing { word, .. } => d.hint(format!("add the line, for example {}; or export the cloud again", example(word))),
            NotThisFormat { format, .. } => d.hint(match *format {
                "NPY" => "it is written by numpy.save(\"map.npy\", array); is the file's ending right?",
                _ => "is the file's ending right? the format is told by it",
            }),
            ImageAlone { sheet } => d.hint(format!("name the .yaml beside it: `{sheet}`")),
            Columns { .. } => d.hint("a point is x, y and z in metres: three numbers a line at least, with one kind of separator"),
            NotANumber { .. } => d.hint("write a number in metres, decimals with a point; comments begin with `#`"),
            NoCoordinate { missing, at, .. } => d.maybe_at(at.as_ref()).hint(format!(
                "coordinates are called x, y, z: `FIELDS x y z` in a PCD, `property float {missing}` of the vertices in a PLY"
            )),
            NoColumn { .. } => d.hint("columns of coordinates are called x, y, z or x_m, y_m, z_m; without a header they are the first three"),
            Truncated { promised, have_bytes, promised_bytes, .. } => d
                .hint("the file was cut off while it was written or copied, or its header lies; make it again")
                .number("promised", *promised as f64)
                .number("promised_bytes", *promised_bytes as f64)
                .number("have_bytes", *have_bytes as f64),
            Surplus { .. } | RowsDiffer { .. } => d.hint("the header lies, or the file was cut off; make it again"),
            MixedSeparators { .. } => d.hint("write decimals with a point, columns with one kind of separator"),
            NoPoints { points, not_finite } => {
                d.hint("export it again: a map needs one finite point at least")
                    .number("points", *points as u64)
                    .number("not_finite", *not_finite as u64)
            }
            FarAway { .. } => d.hint("metres are expected; of a georeferenced cloud subtract the offset first"),
            TooLarge { enough: Some(enough), .. } => {
                d.hint(format!("resolution_m: {enough} would do, or cut the map to what is driven on"))
            }
            TooLarge { enough: None, .. } => d.hint("cut the map to what is driven on, or `height_m` to the robot's"),
            Memory { .. } => d.hint(memory::HINT),
            NoLeaves => d.hint("an octree without known space says nothing about the floor: was it written before the first scan?"),
            TreeCut { .. } | NodesDiffer { .. } => {
                d.hint("the file was cut off while it was written or copied, or its header lies; make it again")
            }
            Resolution { at, .. } => d.maybe_at(at.as_ref()).hint("metres per cell, such as 0.05"),
            ResolutionDiffers { own, .. } => d.hint(format!("leave `resolution_m` out, or write {own}")),
            NoResolution => d.hint(
                "write `resolution_m` (and `origin_m`) in the mission's `map:`, or {\"resolution\": 0.05, \"origin\": [x, y, z]} \
                 in a .json of the same name beside it",
            ),
            Origin { at, .. } => d.maybe_at(at.as_ref()).hint("metres: [x, y, yaw] in a map_server .yaml, [x, y, z] of voxels"),
            Description { what, at, .. } => d.maybe_at(at.as_ref()).hint(match *what {
                "YAML" => "a map_server .yaml has `image: map.pgm`, `resolution: 0.05` and `origin: [0, 0, 0]`, one a line",
                _ => "it is JSON such as {\"resolution\": 0.05, \"origin\": [0, 0, 0]}",
            }),
            OriginUnused => d.hint("remove `origin_m`"),
            Slab { .. } => d.hint("such as `height_m: [0.02, 1.0]`, in metres"),
            Box { .. } => d.hint("write the lower corner first, in metres"),
            NpyHeader { .. } => d.hint("write the array with numpy.save"),
            NpyType { descr, .. } if !descr.contains(['f', 'i', 'u', 'b']) => {
                d.hint("convert it first: numpy.save(file, points.astype(\"f4\"))")
            }
            TooDeep { .. } | NoOccupancy { .. } | Damaged { .. } | UnpackedSize { .. } => {
                d.hint("the file is damaged: copy or export it again")
            }
            #[cfg(feature = "laz")]
            LazDamaged { .. } => d.hint("the file is damaged: copy or export it again"),
            LasHeader { .. } => d.hint("the file is damaged or of a newer kind; `pdal translate in.las out.las` writes it anew"),
            PgmHeader { .. } => d.hint("a PGM begins with P5 or P2, then width, height, maximum: such as `P5 640 480 255`"),
            Pixel { max, .. } => d.hint(format!("write a larger maximum than {max} in the header, or correct the pixel")),
            NpyType { expected: "booleans or integers", .. } => d.hint("threshold it first: numpy.save(file, grid > 0.5)"),
            NpyType { .. } => d.hint("convert it first: numpy.save(file, points.astype(\"f4\"))"),
            NpyShape { shape } if shape.first() == Some(&3) => d.hint("it looks transposed: save points.T"),
            NpyShape { .. } => d.hint("reshape it: points.reshape(-1, 3), or a grid with three axes"),
            Mode { mode, at } => d.at(at).hint(suggestion(mode, ["trinary", "scale", "raw"], "modes are", "")),
            NoImage { at, .. } => d.at(at).hint("the path is relative to the .yaml"),
            NotPgm { .. } => d.hint("convert it, e.g. `magick map.png map.pgm`, and name that in the .yaml"),
        }
    }
}

impl MapError {
    fn code(&self) -> &'static str {
        use MapError::*;
        match self {
            Format { .. } | LazNotBuilt | ImageAlone { .. } | NotThisFormat { .. } | NotPgm { .. } => "map/format",
            NoHeaderEnd { .. }
            | UnknownHeaderLine { .. }
            | HeaderTwice { .. }
            | HeaderMissing { .. }
            | HeaderValue { .. }
            | HeaderLength { .. }
            | PointsDiffer { .. }
            | NpyHeader { .. }
            | PgmHeader { .. }
            | LasHeader { .. }
            | UnpackedSize { .. } => "map/header",
            NoCoordinate { .. } | NoColumn { .. } => "map/no-coordinate",
            Truncated { .. } => "map/truncated",
            Surplus { .. } => "map/surplus",
            RowsDiffer { promised, have, .. } if have < promised => "map/truncated",
            RowsDiffer { .. } => "map/surplus",
            TreeCut { .. } => "map/truncated",
            NodesDiffer { .. } => "map/surplus",
            TooDeep { .. } | NoOccupancy { .. } => "map/damaged",
            NoLeaves => "map/no-points",
            Columns { .. } | NotANumber { .. } | MixedSeparators { .. } => "map/row",
            Damaged { .. } => "map/damaged",
            #[cfg(feature = "laz")]
            LazDamaged { .. } => "map/damaged",
            NoPoints { .. } => "map/no-points",
            FarAway { .. } => "map/far-away",
            TooLarge { .. } | Memory { .. } => "map/too-large",
            Resolution { .. } | NoResolution => "map/resolution",
            ResolutionDiffers { .. } => "map/resolution-differs",
            OriginUnused | Origin { .. } => "map/origin",
            Slab { .. } => "map/height",
            Box { .. } => "map/box",
            NpyType { .. } => "map/type",
            NpyShape { .. } => "map/shape",
            Description { .. } => "map/description",
            Mode { .. } => "map/mode",
            NoImage { .. } => "map/no-image",
            Pixel { .. } => "map/pixel",
        }
    }
}
