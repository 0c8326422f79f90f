//! Maps and robots that cannot be what they say.

use super::bad_input::spoiled;
use super::sandbox::Sandbox;

/// Makes the mission use a map file of these bytes.
fn map(file: &'static str, bytes: impl AsRef<[u8]>) -> impl FnOnce(&Sandbox) {
    move |s| {
        s.write(&format!("maps/{file}"), bytes);
        s.edit("missions/a.yaml", "first.csv", file);
    }
}

/// Makes the mission use a shipped map, and spoils that file.
fn shipped(file: &'static str, spoil: impl FnOnce(Vec<u8>) -> Vec<u8>) -> impl FnOnce(&Sandbox) {
    move |s| {
        s.ship(&format!("maps/{file}"));
        let bytes = spoil(s.read(&format!("maps/{file}")));
        map(file, bytes)(s);
    }
}

fn replaced(bytes: Vec<u8>, from: &str, to: &str) -> Vec<u8> {
    let at = bytes.windows(from.len()).position(|w| w == from.as_bytes()).expect("is in there");
    [&bytes[..at], to.as_bytes(), &bytes[at + from.len()..]].concat()
}

#[test]
fn point_files() {
    spoiled("pcd_truncated", 2, shipped("barn_29.pcd", |b| b[..b.len() / 2].to_vec()));
    spoiled("pcd_lies", 2, shipped("barn_29.pcd", |b| replaced(b, "POINTS 22007", "POINTS 99999999")));
    spoiled("pcd_header_cut", 2, shipped("barn_29.pcd", |b| b[..60].to_vec()));
    spoiled("pcd_no_x", 2, shipped("barn_29.pcd", |b| replaced(b, "FIELDS x y z", "FIELDS a y z")));
    spoiled("pcd_empty", 2, map("m.pcd", ""));
    spoiled(
        "ply_garbage",
        2,
        map("m.ply", "ply\nformat ascii 1.0\nelement vertex 2\nproperty float x\nend_header\n1\n"),
    );
    spoiled("csv_words", 2, map("m.csv", "x_m,y_m,z_m\n0,0,0\n1,wall,0\n"));
    spoiled("csv_two_columns", 2, map("m.csv", "x_m,y_m\n0,0\n1,1\n"));
    spoiled("csv_no_finite_point", 2, map("m.csv", "x_m,y_m,z_m\nnan,0,0\n"));
    spoiled("csv_huge", 2, map("m.csv", "x_m,y_m,z_m\n0,0,0.1\n1e300,0,0.1\n"));
    spoiled("csv_wide", 2, map("m.csv", "x_m,y_m,z_m\n0,0,0.1\n900000,900000,0.1\n"));
}

#[test]
fn grids() {
    let with_grid = |s: &Sandbox| s.edit("missions/a.yaml", "\n  resolution_m: 0.05", "");
    spoiled("npy_garbage", 2, map("m.npy", "not numpy"));
    spoiled("npy_truncated", 2, |s| {
        shipped("levine_voxels.npy", |b| b[..b.len() / 2].to_vec())(s);
        s.ship("maps/levine_voxels.json");
        with_grid(s);
    });
    spoiled("npy_no_resolution", 2, |s| {
        shipped("levine_voxels.npy", |b| b)(s);
        with_grid(s);
    });
    spoiled("npy_json_garbage", 2, |s| {
        shipped("levine_voxels.npy", |b| b)(s);
        s.write("maps/levine_voxels.json", "{resolution");
    });
    spoiled("npy_resolution_differs", 2, |s| {
        shipped("levine_voxels.npy", |b| b)(s);
        s.ship("maps/levine_voxels.json");
    });
    let depot = |s: &Sandbox| {
        s.ship("maps/depot.yaml");
        s.ship("maps/depot.pgm");
        s.edit("missions/a.yaml", "first.csv", "depot.yaml");
    };
    spoiled("pgm_truncated", 2, |s| {
        depot(s);
        let bytes = s.read("maps/depot.pgm");
        s.write("maps/depot.pgm", &bytes[..bytes.len() / 2]);
    });
    spoiled("pgm_garbage", 2, |s| {
        depot(s);
        s.write("maps/depot.pgm", "P9 nothing");
    });
    spoiled("image_alone", 2, |s| {
        s.ship("maps/depot.pgm");
        s.edit("missions/a.yaml", "first.csv", "depot.pgm");
    });
    spoiled("map_resolution_differs", 2, |s| {
        depot(s);
        s.edit("missions/a.yaml", "resolution_m: 0.05", "resolution_m: 0.1");
    });
    spoiled("map_sheet_without_image", 2, |s| {
        depot(s);
        s.edit("maps/depot.yaml", "image: depot.pgm\n", "");
    });
    spoiled("map_origin", 2, |s| {
        depot(s);
        s.edit("maps/depot.yaml", "[0.0, 0.0, 0]", "[0.0, .nan, 0]");
    });
}

const URDF: &str = "robots/box_base/box_base.urdf";
const YAML: &str = "robots/box_base/robot.yaml";

#[test]
fn robots() {
    let urdf = |from: &'static str, to: &'static str| move |s: &Sandbox| s.edit(URDF, from, to);
    spoiled("urdf_garbage", 2, |s| s.write(URDF, "<robot name=\"x\"><link"));
    spoiled("urdf_other_root", 2, |s| s.write(URDF, "<sdf version=\"1.6\"/>"));
    spoiled("urdf_xacro", 2, urdf("<box size=\"0.40 0.40 0.30\"/>", "<box size=\"${width} 0.40 0.30\"/>"));
    spoiled("urdf_cycle", 2, |s| {
        let joint =
            "<joint name=\"back\" type=\"fixed\"><parent link=\"left_wheel\"/><child link=\"base_link\"/></joint>";
        s.edit(URDF, "</robot>", &format!("{joint}\n</robot>"));
    });
    spoiled("urdf_two_parents", 2, |s| {
        let joint =
            "<joint name=\"more\" type=\"fixed\"><parent link=\"left_wheel\"/><child link=\"right_wheel\"/></joint>";
        s.edit(URDF, "</robot>", &format!("{joint}\n</robot>"));
    });
    spoiled("urdf_unknown_link", 2, urdf("<child link=\"right_wheel\"/>", "<child link=\"right_weel\"/>"));
    spoiled("urdf_nan", 2, urdf("0.40 0.40 0.30", "0.40 nan 0.30"));
    spoiled("urdf_flat_box", 2, urdf("0.40 0.40 0.30", "0.40 -0.40 0.30"));
    spoiled("zero_track", 2, |s| s.edit(YAML, "track_width_m: 0.32", "track_width_m: 0"));
    spoiled("zero_track_in_urdf", 2, |s| {
        s.edit(YAML, ", track_width_m: 0.32", "");
        s.edit(URDF, "0 -0.16 0.08", "0 0.16 0.08");
    });
    spoiled("no_drive_wheels", 2, |s| {
        let drive = s.text(YAML).lines().find(|l| l.starts_with("drive")).expect("drive").to_owned();
        s.edit(YAML, &drive, "");
        s.edit(URDF, "type=\"continuous\"", "type=\"fixed\"");
    });
    spoiled("unknown_drive_wheel", 2, |s| s.edit(YAML, "left: left_wheel_joint", "left: wheel_left_joint"));
    spoiled("no_wheel_radius", 2, |s| s.edit(YAML, ", wheel_radius_m: 0.08", ""));
    spoiled("wheels_not_coaxial", 2, urdf("0 -0.16 0.08", "0.1 -0.16 0.08"));
    spoiled("unequal_wheels", 2, |s| {
        s.edit("missions/a.yaml", "box_base", "scr_db");
        s.edit("robots/scr_db/robot.yaml", ", wheel_radius_m: 0.08", "");
        let text = s.text("robots/scr_db/scr_db.urdf").replacen("radius=\"0.08\"", "radius=\"0.10\"", 1);
        s.write("robots/scr_db/scr_db.urdf", text);
    });
    spoiled("moving_joint_unknown", 2, |s| {
        s.edit("missions/a.yaml", "box_base", "scr_db");
        s.edit("robots/scr_db/robot.yaml", "moving: [blade]", "moving: [blades]");
    });
    spoiled("mesh_garbage", 2, |s| {
        s.edit(URDF, "<box size=\"0.40 0.40 0.30\"/>", "<mesh filename=\"hull.stl\"/>");
        s.write("robots/box_base/hull.stl", "solid nothing");
    });
    spoiled("mesh_is_a_folder", 2, |s| {
        s.edit(URDF, "<box size=\"0.40 0.40 0.30\"/>", "<mesh filename=\"hull.stl\"/>");
        s.write("robots/box_base/hull.stl/x", "");
    });
    spoiled("mesh_of_unknown_kind", 2, |s| {
        s.edit(URDF, "<box size=\"0.40 0.40 0.30\"/>", "<mesh filename=\"hull.fbx\"/>");
        s.write("robots/box_base/hull.fbx", "x");
    });
}
