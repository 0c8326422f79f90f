//! Writers of every format, as simple as can be: the other side of the readers.

use super::super::lzf;

/// How the numbers of a PCD or PLY are written.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Kind {
    Ascii,
    Little,
    Big,
    Compressed,
}

/// A PCD of fields `intensity` (U1), z (F8), x (F4), `histogram` (I2 x 3), y (F4), organised as 1 row or, if the number is even, 2.
pub fn pcd(points: &[[f64; 3]], kind: Kind) -> Vec<u8> {
    let n = points.len();
    let height = if n.is_multiple_of(2) { 2 } else { 1 };
    let data = match kind {
        Kind::Ascii => "ascii",
        Kind::Compressed => "binary_compressed",
        _ => "binary",
    };
    let mut out = format!(
        "# .PCD v0.7 - Point Cloud Data file format\nVERSION 0.7\nFIELDS intensity z x histogram y\nSIZE 1 8 4 2 4\n\
         TYPE U F F I F\nCOUNT 1 1 1 3 1\nWIDTH {}\nHEIGHT {height}\nVIEWPOINT 0 0 0 1 0 0 0\nPOINTS {n}\nDATA {data}\n",
        n / height
    )
    .into_bytes();
    let field = |p: &[f64; 3], k: usize| match k {
        0 => vec![7u8],
        1 => p[2].to_le_bytes().to_vec(),
        2 => (p[0] as f32).to_le_bytes().to_vec(),
        3 => [1i16, -1, 300].iter().flat_map(|v| v.to_le_bytes()).collect(),
        _ => (p[1] as f32).to_le_bytes().to_vec(),
    };
    match kind {
        Kind::Ascii => {
            for p in points {
                out.extend(format!("7 {} {} 1 -1 300 {}\n", p[2], p[0], p[1]).bytes());
            }
        }
        Kind::Compressed => {
            let raw: Vec<u8> = (0..5).flat_map(|k| points.iter().flat_map(move |p| field(p, k))).collect();
            let packed = lzf::pack(&raw);
            out.extend((packed.len() as u32).to_le_bytes());
            out.extend((raw.len() as u32).to_le_bytes());
            out.extend(packed);
        }
        _ => out.extend(points.iter().flat_map(|p| (0..5).flat_map(move |k| field(p, k)))),
    }
    out
}

/// A PLY: a camera first, then vertices with a colour between the coordinates (and a list, if asked for), then faces.
pub fn ply(points: &[[f64; 3]], kind: Kind, lists: bool) -> Vec<u8> {
    let format = match kind {
        Kind::Ascii => "ascii",
        Kind::Big => "binary_big_endian",
        _ => "binary_little_endian",
    };
    let list = if lists { "property list uchar short around\n" } else { "" };
    let mut out = format!(
        "ply\r\nformat {format} 1.0\ncomment made for a test\nelement camera 2\nproperty float f\nproperty list uchar int ids\n\
         element vertex {}\nproperty double x\nproperty uchar red\n{list}property float y\nproperty float32 z\n\
         element face 1\nproperty list uchar int vertex_indices\nend_header\n",
        points.len()
    )
    .into_bytes();
    if kind == Kind::Ascii {
        out.extend(b"1.5 2 10 20\n2.5 0\n\n");
        for p in points {
            let list = if lists { "2 -5 6 " } else { "" };
            out.extend(format!("{} 200 {list}{} {}\n", p[0], p[1], p[2]).bytes());
        }
        out.extend(b"3 0 1 2\n");
        return out;
    }
    let mut put = |little: &[u8]| {
        let mut raw = little.to_vec();
        if kind == Kind::Big {
            raw.reverse();
        }
        out.extend(raw);
    };
    for ids in [vec![10i32, 20], vec![]] {
        put(&1.5f32.to_le_bytes());
        put(&[ids.len() as u8]);
        ids.iter().for_each(|id| put(&id.to_le_bytes()));
    }
    for p in points {
        put(&p[0].to_le_bytes());
        put(&[200]);
        if lists {
            put(&[2]);
            put(&(-5i16).to_le_bytes());
            put(&6i16.to_le_bytes());
        }
        put(&(p[1] as f32).to_le_bytes());
        put(&(p[2] as f32).to_le_bytes());
    }
    put(&[1]);
    put(&0i32.to_le_bytes());
    out
}

/// An NPY header and data.
pub fn npy(descr: &str, fortran: bool, shape: &[u64], data: &[u8]) -> Vec<u8> {
    let order = if fortran { "True" } else { "False" };
    let shape: Vec<String> = shape.iter().map(u64::to_string).collect();
    let mut text = format!("{{'descr': '{descr}', 'fortran_order': {order}, 'shape': ({},), }}", shape.join(", "));
    while (text.len() + 11) % 64 != 0 {
        text.push(' ');
    }
    text.push('\n');
    let mut out = b"\x93NUMPY\x01\x00".to_vec();
    out.extend((text.len() as u16).to_le_bytes());
    out.extend(text.bytes());
    out.extend(data);
    out
}
