//! Small valid files of every kind.

use trajc::command::{CommandRow, CommandTable};
use trajc::emit::csv::{self, CsvHeader};
use trajc::emit::mcap::{self, McapInputs};
use trajc::geom::Pose2;
use trajc::mission::{LimitsSpec, Sampling};
use trajc::robot::{self, NoFiles, RobotInputs, RobotModel, spec::RobotSpec};

pub const CONV: &str = include_str!("../../robots/conv/conv.urdf");
pub const BOX: &str = include_str!("../../robots/box_base/box_base.urdf");
pub const BLADES: &str = include_str!("../../robots/scr_db/scr_db.urdf");

const POINTS: [[f32; 3]; 6] =
    [[0.0, 0.0, 0.0], [1.0, 0.0, 0.1], [1.0, 2.0, 0.2], [0.3, 0.4, 0.3], [2.0, 2.0, 0.05], [-1.0, 0.5, 0.6]];

fn packed() -> Vec<u8> {
    POINTS.iter().flatten().flat_map(|v| v.to_le_bytes()).collect()
}

fn rows(separator: &str) -> String {
    POINTS.iter().map(|p| p.map(|v| v.to_string()).join(separator) + "\n").collect()
}

fn pcd_header(data: &str) -> String {
    let n = POINTS.len();
    format!(
        "# .PCD v0.7\nVERSION 0.7\nFIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nCOUNT 1 1 1\nWIDTH {n}\nHEIGHT 1\n\
         VIEWPOINT 0 0 0 1 0 0 0\nPOINTS {n}\nDATA {data}\n"
    )
}

pub fn pcd() -> Vec<Vec<u8>> {
    let ascii = pcd_header("ascii") + &rows(" ");
    let binary = [pcd_header("binary").into_bytes(), packed()].concat();
    // All values of x, then of y, then of z, as literals of LZF; and a run of zeros as a match.
    let columns: Vec<u8> = (0..3).flat_map(|a| POINTS.iter().flat_map(move |p| p[a].to_le_bytes())).collect();
    let literals: Vec<u8> = columns.chunks(32).flat_map(|c| [&[c.len() as u8 - 1], c].concat()).collect();
    let block = |packed: &[u8], size: usize| {
        [&(packed.len() as u32).to_le_bytes(), &(size as u32).to_le_bytes(), packed].concat()
    };
    let compressed = [pcd_header("binary_compressed").into_bytes(), block(&literals, columns.len())].concat();
    let zeros = block(&[0, 0, 0xe0, columns.len() as u8 - 1 - 9, 0], columns.len());
    let matched = [pcd_header("binary_compressed").into_bytes(), zeros].concat();
    vec![ascii.into_bytes(), binary, compressed, matched]
}

pub fn ply() -> Vec<Vec<u8>> {
    let n = POINTS.len();
    let header = |format: &str, faces: &str| {
        format!(
            "ply\nformat {format} 1.0\ncomment c\n{faces}element vertex {n}\nproperty float x\nproperty float y\nproperty float z\n\
             end_header\n"
        )
    };
    let faces = "element face 2\nproperty list uchar int vertex_indices\n";
    let lists: Vec<u8> = [[3, 0, 1, 2], [3, 1, 2, 3]]
        .iter()
        .flat_map(|f: &[u8; 4]| [vec![f[0]], f[1..].iter().flat_map(|v| [*v, 0, 0, 0]).collect()].concat())
        .collect();
    let big: Vec<u8> = POINTS.iter().flatten().flat_map(|v| v.to_be_bytes()).collect();
    let with_list = format!(
        "ply\nformat binary_little_endian 1.0\nelement vertex {n}\nproperty float x\nproperty float y\nproperty float z\n\
         property list uchar uchar tags\nend_header\n"
    );
    let tagged: Vec<u8> = POINTS
        .iter()
        .flat_map(|p| [p.iter().flat_map(|v| v.to_le_bytes()).collect(), vec![2, 7, 8]].concat())
        .collect();
    vec![
        (header("ascii", faces) + "3 0 1 2\n3 1 2 3\n" + &rows(" ")).into_bytes(),
        [header("binary_little_endian", "").into_bytes(), packed()].concat(),
        [header("binary_little_endian", faces).into_bytes(), lists, packed()].concat(),
        [header("binary_big_endian", "").into_bytes(), big].concat(),
        [with_list.into_bytes(), tagged].concat(),
    ]
}

pub fn las() -> Vec<Vec<u8>> {
    [(2u8, 227u16, 0u8, 20u16), (4, 375, 6, 30)]
        .into_iter()
        .map(|(minor, size, format, record)| {
            let mut bytes = vec![0; size as usize];
            bytes[..4].copy_from_slice(b"LASF");
            (bytes[24], bytes[25], bytes[104]) = (1, minor, format);
            bytes[94..96].copy_from_slice(&size.to_le_bytes());
            bytes[96..100].copy_from_slice(&u32::from(size).to_le_bytes());
            bytes[105..107].copy_from_slice(&record.to_le_bytes());
            bytes[107..111].copy_from_slice(&(POINTS.len() as u32).to_le_bytes());
            if minor >= 4 {
                bytes[247..255].copy_from_slice(&(POINTS.len() as u64).to_le_bytes());
            }
            for a in 0..3 {
                bytes[131 + 8 * a..139 + 8 * a].copy_from_slice(&0.001f64.to_le_bytes());
            }
            for p in POINTS {
                let mut point: Vec<u8> = p.iter().flat_map(|v| ((v * 1000.0) as i32).to_le_bytes()).collect();
                point.resize(record as usize, 0);
                bytes.extend(point);
            }
            bytes
        })
        .collect()
}

pub fn octomap() -> Vec<Vec<u8>> {
    // Fifteen times the first child, then eight leaves: three occupied, five free.
    let bits: Vec<u8> = [[3, 0].repeat(15), vec![0b01_10_10_01, 0b01_01_10_01]].concat();
    let header = |kind: &str, id: &str, size: usize| {
        format!("# Octomap OcTree{kind} file\nid {id}\nsize {size}\nres 0.1\ndata\n")
    };
    let record = |odds: f32, children: u8| [&odds.to_le_bytes()[..], &[children]].concat();
    // Large leaves, more than 2^21 cells in all: a list of them is larger than their grid.
    let large = [[3, 0].repeat(8), vec![3, 0x90, 0x1c, 0, 3, 0, 3, 0, 0x69, 0x59]].concat();
    let mut records = record(0.5, 0b11);
    records.extend([record(0.8, 0b1000_0001), record(-0.4, 0), record(0.9, 0), record(-1.0, 0)].concat());
    vec![
        [header(" binary", "OcTree", 1 + 15 + 8).into_bytes(), bits].concat(),
        [header(" binary", "OcTree", 1 + 15 + 8).into_bytes(), large].concat(),
        [header("", "OcTree", 5).into_bytes(), records].concat(),
    ]
}

fn npy_of(header: &str, data: &[u8]) -> Vec<u8> {
    let header = format!("{header:<117}\n");
    [b"\x93NUMPY\x01\x00".as_slice(), &(header.len() as u16).to_le_bytes(), header.as_bytes(), data].concat()
}

pub fn npy() -> Vec<Vec<u8>> {
    let n = POINTS.len();
    let voxels: Vec<u8> = (0..60u8).map(|k| u8::from(k % 7 == 0)).collect();
    vec![
        npy_of("{'descr': '|b1', 'fortran_order': False, 'shape': (3, 4, 5), }", &voxels),
        npy_of("{'descr': '|u1', 'fortran_order': True, 'shape': (5, 4, 3), }", &voxels),
        npy_of(&format!("{{'descr': '<f4', 'fortran_order': False, 'shape': ({n}, 3), }}"), &packed()),
    ]
}

pub fn npy_notes() -> Vec<Vec<u8>> {
    vec![b"{\"resolution\": 0.1, \"origin\": [0.0, -1.0, 0.0], \"note\": {\"a\": [1, 2]}}".to_vec()]
}

pub fn tables() -> Vec<Vec<u8>> {
    [
        "x,y,z\n".to_owned() + &rows(","),
        "# c\n".to_owned() + &rows(" "),
        "x_m;y_m;z_m;r\n".to_owned() + &rows(";").replace('\n', ";1\n"),
    ]
    .map(String::into_bytes)
    .to_vec()
}

pub fn sheets() -> Vec<Vec<u8>> {
    [
        "image: map.pgm\nresolution: 0.05\norigin: [-1.0, -2.0, 0.0]\noccupied_thresh: 0.65\nfree_thresh: 0.196\nnegate: 0\nmode: trinary\n",
        "image: map.pgm\nresolution: 0.1\norigin: [0, 0, 0.7]\nnegate: true\nmode: scale\n",
    ]
    .map(|text| text.as_bytes().to_vec())
    .to_vec()
}

pub fn images() -> Vec<Vec<u8>> {
    let pixels: Vec<u8> = (0..48u8).map(|k| [0, 205, 254][usize::from(k) % 3]).collect();
    let text: String = pixels.iter().map(|v| format!("{v} ")).collect();
    let wide: Vec<u8> = pixels.iter().flat_map(|v| [*v, 7]).collect();
    vec![
        [b"P5\n# c\n8 6\n255\n".as_slice(), &pixels].concat(),
        format!("P2\n8 6 255\n{text}\n").into_bytes(),
        [b"P5 8 6 65535\n".as_slice(), &wide].concat(),
    ]
}

/// Binary and ascii STL; the third is an OBJ.
pub fn meshes() -> Vec<Vec<u8>> {
    let corners = [[0.0f32, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [0.2, 0.2, 0.2]];
    let faces = [[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3], [4, 1, 2]];
    let mut binary = vec![0; 80];
    binary.extend((faces.len() as u32).to_le_bytes());
    let mut text = "solid a\n".to_owned();
    for face in faces {
        binary.extend([0; 12]);
        text += "facet normal 0 0 1\n outer loop\n";
        for corner in face.map(|c: usize| corners[c]) {
            binary.extend(corner.iter().flat_map(|v| v.to_le_bytes()));
            text += &format!("  vertex {} {} {}\n", corner[0], corner[1], corner[2]);
        }
        binary.extend([0; 2]);
        text += " endloop\nendfacet\n";
    }
    text += "endsolid a\n";
    let obj: String =
        corners.iter().map(|c| format!("v {} {} {}\n", c[0], c[1], c[2])).collect::<String>() + "f 1 2 3\n";
    vec![binary, text.into_bytes(), obj.into_bytes()]
}

pub fn urdfs() -> Vec<Vec<u8>> {
    vec![
        CONV.into(),
        BOX.into(),
        BLADES.into(),
        include_bytes!("../../robots/arm4/arm4.urdf").to_vec(),
        BOX.replace("<box size=\"0.40 0.40 0.30\"/>", "<mesh filename=\"hull.obj\" scale=\"1 1 1\"/>").into_bytes(),
    ]
}

pub fn robots() -> Vec<Vec<u8>> {
    vec![
        include_bytes!("../../robots/scr_db/robot.yaml").to_vec(),
        include_bytes!("../../robots/arm4/robot.yaml").to_vec(),
        include_bytes!("../../robots/conv/robot.yaml").to_vec(),
    ]
}

pub fn missions() -> Vec<Vec<u8>> {
    vec![
        include_bytes!("../../missions/arch_bridges.yaml").to_vec(),
        include_bytes!("../../missions/site.yaml").to_vec(),
        include_bytes!("../../missions/s_curve.yaml").to_vec(),
        include_bytes!("../../missions/arm7.yaml").to_vec(),
    ]
}

pub fn paths() -> Vec<Vec<u8>> {
    vec![
        b"# a\nx_m,y_m\n0,0\n1,0.5\n2,0.4\n3,1\n".to_vec(),
        b"x_m,y_m,joint.left_blade.pos_rad\n0,0,0.1\n1,0,0.2\n2,1,0.3\n".to_vec(),
    ]
}

pub fn scenes() -> Vec<Vec<u8>> {
    vec![
        br#"{"schema": "trajc.scenes/1", "name": "a", "seed": 1, "bounds": [[0, 0, 0], [10, 10, 1]], "resolution": 0.1,
"clearance_m": 0.05, "limits": {"base": {"eta": 0.4}}, "scenes": [
{"id": "a", "kind": "k", "boxes": [{"min": [1, 1, 0], "max": [2, 2, 0.5]}], "start": {"x": 0.5, "y": 0.5, "yaw": 0},
"goal": {"x": 9, "y": 9, "yaw": 1.5, "joints": {"left": 0.1}}}, {"id": "b", "boxes": [], "start": {"x": 1, "y": 2, "yaw": 3},
"goal": {"x": 2, "y": 1}, "passage_radius": 0.4}]}"#
            .to_vec(),
    ]
}

pub fn robot(urdf: &str) -> RobotModel {
    let yaml = "drive: {wheel_radius_m: 0.1}\nlimits: {wheel: {velocity_radps: 6.25, acceleration_mps2: 0.5, jerk_mps3: 2.0}}\n";
    let spec = robot::spec::parse("robot.yaml", yaml).unwrap_or_else(|_| RobotSpec::default());
    let inputs =
        RobotInputs { spec: &spec, urdf: ("a.urdf", urdf), files: &mut NoFiles, overrides: &LimitsSpec::default() };
    robot::parse(inputs).expect("shipped")
}

fn table() -> CommandTable {
    let row = |k: u32| CommandRow {
        wheel_left: 1.0,
        wheel_right: 1.0,
        joint_positions: vec![0.1],
        joint_velocities: vec![0.0],
        pose: Pose2 { x: 0.01 * f64::from(k), y: 0.0, yaw: 0.0 },
    };
    CommandTable {
        sampling_time: 0.1,
        sampling: Sampling::Mean,
        wheel_radii: 0.1.into(),
        track_width: 0.4,
        joints: vec![("blade".into(), false)],
        rows: (0..12).map(row).collect(),
    }
}

fn header() -> CsvHeader {
    CsvHeader {
        mission: "a.yaml".into(),
        robot: "r.yaml".into(),
        inputs_blake3: "0".repeat(64),
        ..CsvHeader::default()
    }
}

pub fn commands() -> Vec<Vec<u8>> {
    vec![csv::write(&table(), &header()).into_bytes()]
}

pub fn recordings() -> Vec<Vec<u8>> {
    let robot = robot(CONV);
    let written = mcap::write(&McapInputs {
        table: &table(),
        header: &header(),
        robot: &robot,
        mission: "robot: r.yaml\n",
        robot_yaml: Some("urdf: a.urdf\n"),
        urdf: CONV,
        report: "{}",
        path_csv: None,
        start_file: None,
        meshes: &[],
    })
    .expect("numbers are finite");
    // The same without compression and checksums, so that a changed byte is not found by them.
    let options = ::mcap::WriteOptions::new()
        .profile("ros2")
        .compression(None)
        .calculate_chunk_crcs(false)
        .calculate_data_section_crc(false)
        .calculate_summary_section_crc(false)
        .calculate_attachment_crcs(false);
    let mut plain = options.create(std::io::Cursor::new(Vec::new())).expect("memory");
    for record in ::mcap::read::ChunkFlattener::new(&written).expect("good") {
        if let ::mcap::records::Record::Metadata(metadata) = record.expect("good") {
            plain.write_metadata(&metadata).expect("memory");
        }
    }
    for message in ::mcap::MessageStream::new(&written).expect("good") {
        plain.write(&message.expect("good")).expect("memory");
    }
    plain.finish().expect("memory");
    vec![written, plain.into_inner().into_inner()]
}
