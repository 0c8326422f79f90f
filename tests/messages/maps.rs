//! Mistakes in maps.

use super::case::{Case, MAP, MISSION, Why, case};
use super::sandbox::Sandbox;

/// A map of this name and content in the place of the mission's.
fn map(file: &'static str, bytes: impl AsRef<[u8]> + 'static) -> impl Fn(&str) -> Case {
    let bytes = bytes.as_ref().to_vec();
    move |name| {
        let bytes = bytes.clone();
        let name: &'static str = String::leak(name.to_owned());
        case(name).with(move |s| {
            s.write(&format!("maps/{file}"), &bytes);
            s.edit(MISSION, "first.csv", file);
        })
    }
}

const HEAD: &str = "VERSION .7\nFIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nCOUNT 1 1 1\nWIDTH 1\nHEIGHT 1\nVIEWPOINT 0 0 0 1 0 0 0\nPOINTS 1\nDATA ascii\n0 0 0\n";

/// A small PCD after an edit.
fn pcd(name: &'static str, from: &'static str, to: &'static str) -> Case {
    assert!(HEAD.contains(from), "{from}");
    map("m.pcd", HEAD.replacen(from, to, 1))(name)
}

const PCD: &str = "maps/m.pcd";

pub fn cases() -> Vec<Case> {
    let mut all = files();
    all.extend(tables());
    all.extend(pcds());
    all.extend(plys());
    all.extend(arrays());
    all.extend(octrees());
    all.extend(images());
    all
}

fn files() -> Vec<Case> {
    vec![
        case("missing")
            .edit(MISSION, "first.csv", "frist.csv")
            .at(MISSION, "file: |../maps/frist.csv")
            .found("`maps/frist.csv`")
            .expected("relative to the file that names them")
            .hint("did you mean `first.csv`?"),
        case("missing_folder")
            .edit(MISSION, "../maps/first.csv", "../map/first.csv")
            .at(MISSION, "file: |../map/first.csv")
            .found("`map/first.csv`")
            .expected("no folder `map`")
            .hint("did you mean `maps`?"),
        case("folder")
            .edit(MISSION, "maps/first.csv", "maps")
            .at(MISSION, "file: |../maps")
            .found("is a folder")
            .expected("expected a file")
            .hint("first.csv"),
        map("m.stl", "solid")("unknown_kind")
            .in_file("maps/m.stl", Why::WholeFile)
            .found("`.stl`")
            .expected("point clouds .pcd, .ply")
            .hint("map_server .yaml"),
        map("m", "x")("no_ending")
            .in_file("maps/m", Why::WholeFile)
            .found("without an ending")
            .expected("voxels .npy")
            .hint(".las"),
        case("empty")
            .write(MAP, "")
            .in_file(MAP, Why::WholeFile)
            .found("the file has none")
            .expected("points")
            .hint("export it again"),
        case("all_nan")
            .write(MAP, "x_m,y_m,z_m\nnan,0,0\n")
            .in_file(MAP, Why::WholeFile)
            .found("1 are not finite")
            .expected("points")
            .hint("export it again"),
        case("far_away")
            .write(MAP, "x_m,y_m,z_m\n0,0,0.1\n1e300,0,0.1\n")
            .in_file(MAP, Why::WholeFile)
            .found("1e300 m along x")
            .expected("metres")
            .hint("subtract the offset"),
        case("too_large")
            .write(MAP, "x_m,y_m,z_m\n0,0,0.1\n900000,900000,0.1\n")
            .in_file(MAP, Why::WholeFile)
            .found("18000001 x 18000001")
            .expected("can be handled")
            .hint("resolution_m: 60"),
        case("more_than_max_memory")
            .with(|s: &Sandbox| s.write(MAP, "x,y,z\n".to_owned() + &"0,0,0\n".repeat(400_000)))
            .run(&["compile", MISSION, "--max-memory", "2MiB"])
            .at(MISSION, "file: |../maps/first.csv")
            .found("2.3 MiB of memory")
            .expected("--max-memory 2 MiB")
            .hint("allow more with --max-memory"),
    ]
}

fn tables() -> Vec<Case> {
    vec![
        case("csv_word")
            .write(MAP, "x_m,y_m,z_m\n0,0,0\n1,wall,0\n")
            .at(MAP, "wall")
            .found("`wall`")
            .expected("a number")
            .hint("point"),
        case("csv_two_columns")
            .write(MAP, "x_m,y_m\n0,0\n1,1\n")
            .at(MAP, "x_m,y_m")
            .found("x_m, y_m")
            .expected("column `z`")
            .hint("x, y, z"),
        case("csv_no_header_short")
            .write(MAP, "0 0 0\n5 5\n")
            .at(MAP, "5 5")
            .found("`5 5`")
            .expected("expected x, y and z")
            .hint("three numbers a line"),
        case("csv_commas")
            .write(MAP, "x;y;z\n1,5;2,0;0,1\n")
            .at(MAP, "1,5;2")
            .found("both commas and semicolons")
            .expected("one kind of separator")
            .hint("decimals with a point"),
    ]
}

fn pcds() -> Vec<Case> {
    vec![
        pcd("pcd_no_data", "DATA ascii", "")
            .in_file(PCD, Why::WholeFile)
            .nothing_found(Why::Missing)
            .expected("`DATA` line")
            .hint("DATA ascii, binary or binary_compressed"),
        pcd("pcd_word", "VIEWPOINT", "VIEWPIONT")
            .at(PCD, "VIEWPIONT")
            .found("`VIEWPIONT`")
            .expected("`VIEWPOINT`")
            .hint("did you mean `VIEWPOINT`?"),
        pcd("pcd_twice", "HEIGHT 1", "WIDTH 1")
            .at(PCD, "WIDTH 1\n|WIDTH 1")
            .found("`WIDTH`")
            .expected("twice")
            .hint("keep one"),
        pcd("pcd_no_fields", "FIELDS x y z\n", "")
            .in_file(PCD, Why::WholeFile)
            .nothing_found(Why::Missing)
            .expected("`FIELDS` line")
            .hint("FIELDS x y z"),
        pcd("pcd_data_word", "DATA ascii", "DATA text")
            .at(PCD, "DATA text")
            .found("`text`")
            .expected("ascii, binary or binary_compressed")
            .hint("DATA ascii"),
        pcd("pcd_size", "SIZE 4 4 4", "SIZE 4 3 4")
            .at(PCD, "SIZE 4 3")
            .found("3")
            .expected("4 or 8 with TYPE F")
            .hint("`SIZE 4 4 4` with `TYPE F F F`"),
        pcd("pcd_types", "TYPE F F F", "TYPE F F")
            .at(PCD, "TYPE F F")
            .found("2 values")
            .expected("3 fields")
            .hint("one for each field"),
        pcd("pcd_count", "COUNT 1 1 1", "COUNT 1 0 1")
            .at(PCD, "COUNT 1 0")
            .found("`0`")
            .expected("a whole number above 0")
            .hint("1 for x, y and z"),
        pcd("pcd_width", "WIDTH 1", "WIDTH many")
            .at(PCD, "WIDTH many")
            .found("`many`")
            .expected("one whole number")
            .hint("WIDTH"),
        pcd("pcd_points", "POINTS 1", "POINTS 7")
            .at(PCD, "POINTS 7")
            .found("POINTS 7")
            .expected("WIDTH 1 x HEIGHT 1")
            .hint("POINTS 1"),
        pcd("pcd_no_x", "FIELDS x", "FIELDS a")
            .at(PCD, "FIELDS a")
            .found("a, y, z")
            .expected("column `x`")
            .hint("x, y, z"),
        pcd("pcd_row", "0 0 0\n", "0 0\n")
            .edit(PCD, "DATA ascii\n0 0 0", "DATA ascii\n0 0")
            .at(PCD, "ascii\n|0 0\n")
            .found("`0 0`")
            .expected("expected 3")
            .hint("three numbers a line"),
        pcd("pcd_rows", "DATA ascii\n0 0 0\n", "DATA ascii\n0 0 0\n1 1 1\n")
            .in_file(PCD, Why::WholeFile)
            .found("2 are there")
            .expected("1 points")
            .hint("header"),
        case("pcd_cut")
            .ship("maps/barn_29.pcd")
            .edit(MISSION, "first.csv", "barn_29.pcd")
            .halve("maps/barn_29.pcd")
            .in_file("maps/barn_29.pcd", Why::Binary)
            .found("131956 bytes")
            .expected("264084 bytes")
            .hint("cut off while"),
    ]
}

fn plys() -> Vec<Case> {
    const PLY: &str = "maps/m.ply";
    let ply = |name, text: &'static str| map("m.ply", text)(name);
    vec![
        ply("ply_magic", "plie\n").in_file(PLY, Why::WholeFile).found("no PLY file").expected("a line `ply`").hint("ending"),
        ply("ply_no_end", "ply\nformat ascii 1.0\n").in_file(PLY, Why::WholeFile).nothing_found(Why::Missing)
            .expected("`end_header`").hint("cut off"),
        ply("ply_format", "ply\nformat text 1.0\nelement vertex 1\nproperty float x\nproperty float y\nproperty float z\nend_header\n0 0 0\n")
            .at(PLY, "format text").found("`text 1.0`").expected("ascii").hint("binary_little_endian"),
        ply("ply_no_vertex", "ply\nformat ascii 1.0\nend_header\n").in_file(PLY, Why::WholeFile).nothing_found(Why::Missing)
            .expected("`element vertex`").hint("element vertex"),
        ply("ply_no_y", "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nend_header\n1\n").at(PLY, "element vertex")
            .found("the file has x").expected("column `y`").hint("property float y"),
        ply("ply_short", "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\nend_header\n0 0 0\n")
            .in_file(PLY, Why::WholeFile).found("1 are there").expected("3 vert").hint("cut off"),
        ply("ply_word", "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nproperty float y\nproperty float z\nend_header\n0 up 0\n")
            .at(PLY, "up").found("`up`").expected("number").hint("point"),
    ]
}

fn npy(descr: &str, shape: &str, data: usize) -> Vec<u8> {
    let mut head = format!("{{'descr': '{descr}', 'fortran_order': False, 'shape': ({shape}), }}");
    head += &" ".repeat(118 - 11 - head.len());
    head += "\n";
    let mut bytes = b"\x93NUMPY\x01\x00".to_vec();
    bytes.extend(u16::try_from(head.len()).expect("short").to_le_bytes());
    bytes.extend(head.bytes());
    bytes.resize(bytes.len() + data, 0);
    bytes
}

fn arrays() -> Vec<Case> {
    const NPY: &str = "maps/m.npy";
    vec![
        map("m.npy", "not numpy")("npy_magic")
            .in_file(NPY, Why::Binary)
            .found("no NPY file")
            .expected("`\\x93NUMPY`")
            .hint("numpy.save"),
        map("m.npy", npy("<c8", "4, 3", 96))("npy_complex")
            .in_file(NPY, Why::Binary)
            .found("`<c8`")
            .expected("`<f4` or `<f8`")
            .hint("astype"),
        map("m.npy", npy("<f4", "2, 2, 2", 32))("npy_probabilities")
            .in_file(NPY, Why::Binary)
            .found("`<f4`")
            .expected("booleans or integers")
            .hint("grid > 0.5"),
        map("m.npy", npy("<f8", "3, 100", 2400))("npy_transposed")
            .in_file(NPY, Why::Binary)
            .found("[3, 100]")
            .expected("points N x 3")
            .hint("points.T"),
        map("m.npy", npy("<f8", "9", 72))("npy_flat")
            .in_file(NPY, Why::Binary)
            .found("[9]")
            .expected("voxels [ix, iy, iz]")
            .hint("reshape"),
        map("m.npy", npy("<f8", "10, 3", 480))("npy_surplus")
            .in_file(NPY, Why::Binary)
            .found("480 are there")
            .expected("240 bytes")
            .hint("header"),
        map("m.npy", b"\x93NUMPY\x01\x00\x04\x00abcd")("npy_header")
            .in_file(NPY, Why::Binary)
            .found("`abcd`")
            .expected("in braces")
            .hint("numpy.save"),
        map("m.npy", npy("|b1", "2, 2, 2", 8))("npy_no_resolution")
            .with(|s| s.edit(MISSION, "  resolution_m: 0.05\n", ""))
            .in_file(NPY, Why::Binary)
            .nothing_found(Why::Missing)
            .expected("the voxels' size")
            .hint("`resolution_m`"),
        map("m.npy", npy("|b1", "2, 2, 2", 8))("npy_json")
            .write("maps/m.json", "{resolution")
            .at("maps/m.json", "{|resolution")
            .found("`r`")
            .expected("key must be a string")
            .hint("{\"resolution\": 0.05"),
    ]
}

fn octrees() -> Vec<Case> {
    const BT: &str = "maps/m.bt";
    vec![
        map("m.bt", "octree\n")("bt_magic")
            .in_file(BT, Why::Binary)
            .found("no OctoMap file")
            .expected("# Octomap OcTree binary file")
            .hint("ending"),
        map("m.bt", "# Octomap OcTree binary file\nid OcTree\nsize 9\nres 0.1\ndata\n\0")("bt_cut")
            .in_file(BT, Why::Binary)
            .found("only 1 bytes")
            .expected("9 nodes promised")
            .hint("cut off"),
        map("m.bt", "# Octomap OcTree binary file\nid OcTree\nsize 1\nres fine\ndata\n\0\0")("bt_resolution")
            .at(BT, "res fine")
            .found("`fine`")
            .expected("metres")
            .hint("res 0.05"),
        map("m.las", "LASP")("las_magic")
            .in_file("maps/m.las", Why::Binary)
            .found("no LAS file")
            .expected("`LASF`")
            .hint("ending"),
        map("m.las", [b"LASF".as_slice(), &[0; 20], &[3, 0], &[0; 201]].concat())("las_version")
            .in_file("maps/m.las", Why::Binary)
            .found("3.0")
            .expected("1.0 to 1.4")
            .hint("pdal translate"),
    ]
}

const SHEET: &str = "maps/depot.yaml";

/// The depot's sheet after an edit; its image needs not be read for that.
fn sheet(name: &'static str, from: &'static str, to: &'static str) -> Case {
    case(name).ship(SHEET).ship("maps/depot.pgm").edit(MISSION, "first.csv", "depot.yaml").edit(SHEET, from, to)
}

fn images() -> Vec<Case> {
    const PGM: &str = "maps/depot.pgm";
    vec![
        case("image_alone")
            .ship(PGM)
            .edit(MISSION, "first.csv", "depot.pgm")
            .in_file(PGM, Why::WholeFile)
            .found("an image alone")
            .expected("map_server .yaml")
            .hint("`maps/depot.yaml`"),
        sheet("image_missing", "depot.pgm", "depo.pgm")
            .at(SHEET, "depo.pgm")
            .found("`maps/depo.pgm`")
            .expected("relative to")
            .hint("did you mean `depot.pgm`?"),
        sheet("sheet_without_image", "image: depot.pgm\n", "")
            .at_the_top(SHEET)
            .nothing_found(Why::Missing)
            .expected("`image`")
            .hint("`image: map.pgm`"),
        sheet("sheet_origin", "[0.0, 0.0, 0]", "[0.0, .nan, 0]")
            .at(SHEET, "[0.0, .nan")
            .found("NaN")
            .expected("finite")
            .hint("[x, y, yaw]"),
        sheet("sheet_mode", "trinary", "trinry")
            .at(SHEET, "trinry")
            .found("`trinry`")
            .expected("trinary, scale, raw")
            .hint("did you mean `trinary`?"),
        sheet("sheet_threshold", "0.65", "65").at(SHEET, "65").found("`65`").expected("0 to 1").hint("0.65"),
        sheet("sheet_resolution", "resolution: 0.05", "resolution: -1")
            .at(SHEET, "-1")
            .found("-1 m")
            .expected("metres per cell")
            .hint("0.05"),
        sheet("sheet_word", "resolution: 0.05", "resolution: fine")
            .at(SHEET, "fine")
            .found("`fine`")
            .expected("number")
            .hint("0.05"),
        sheet("sheet_resolution_differs", "resolution: 0.05", "resolution: 0.1")
            .at(MISSION, "resolution_m: |0.05")
            .found("cells of 0.05 m")
            .expected("0.1 m")
            .hint("leave `resolution_m` out"),
        sheet("pgm_magic", "0.65", "0.6")
            .write(PGM, "P9 nothing")
            .in_file(PGM, Why::Binary)
            .found("unknown kind")
            .expected("PGM (P5 or P2)")
            .hint("convert it"),
        sheet("png", "0.65", "0.6")
            .write(PGM, b"\x89PNG\r\n")
            .in_file(PGM, Why::Binary)
            .found("a PNG")
            .expected("PGM (P5 or P2)")
            .hint("magick map.png map.pgm"),
        sheet("pgm_cut", "0.65", "0.6")
            .halve(PGM)
            .in_file(PGM, Why::Binary)
            .found("92706 bytes")
            .expected("185428 pixels")
            .hint("cut off"),
        sheet("pgm_maximum", "0.65", "0.6")
            .write(PGM, "P5 2 2 70000\n....")
            .in_file(PGM, Why::Binary)
            .found("`70000`")
            .expected("1 to 65535")
            .hint("width, height, maximum"),
        sheet("pgm_pixel", "0.65", "0.6")
            .write(PGM, "P2 2 2 9\n0 1 2 12\n")
            .in_file(PGM, Why::Binary)
            .found("is 12")
            .expected("maximum 9")
            .hint("maximum"),
    ]
}
