//! LAS and LAZ, written here by the format's own description.

use super::*;

/// What a file is to be.
pub struct Las {
    pub minor: u8,
    pub format: u8,
    pub record: usize,
    pub scale: f64,
    pub offset: [f64; 3],
}

pub const USUAL: Las = Las { minor: 2, format: 3, record: 34, scale: 0.125, offset: [-2.0, 7.0, 0.5] };

impl Las {
    fn records(&self, points: &[[f64; 3]]) -> Vec<u8> {
        let mut out = Vec::new();
        for p in points {
            let start = out.len();
            for (coordinate, offset) in p.iter().zip(self.offset) {
                out.extend((((coordinate - offset) / self.scale).round() as i32).to_le_bytes());
            }
            out.resize(start + self.record, 7);
        }
        out
    }

    /// Everything before the points; `about`: records about the file.
    fn head(&self, points: usize, about: &[u8]) -> Vec<u8> {
        let size = [227, 227, 227, 235, 375][usize::from(self.minor)];
        let mut out = vec![0u8; size];
        out[..4].copy_from_slice(b"LASF");
        (out[24], out[25]) = (1, self.minor);
        out[94..96].copy_from_slice(&(size as u16).to_le_bytes());
        out[96..100].copy_from_slice(&((size + about.len()) as u32).to_le_bytes());
        out[104] = self.format;
        out[105..107].copy_from_slice(&(self.record as u16).to_le_bytes());
        if self.minor < 4 {
            out[107..111].copy_from_slice(&(points as u32).to_le_bytes());
        } else {
            out[247..255].copy_from_slice(&(points as u64).to_le_bytes());
        }
        for a in 0..3 {
            out[131 + 8 * a..139 + 8 * a].copy_from_slice(&self.scale.to_le_bytes());
            out[155 + 8 * a..163 + 8 * a].copy_from_slice(&self.offset[a].to_le_bytes());
        }
        out.extend(about);
        out
    }

    /// A file with something between header and points.
    pub fn write(&self, points: &[[f64; 3]]) -> Vec<u8> {
        [self.head(points.len(), b"about"), self.records(points)].concat()
    }
}

/// Points on the grid of the scale: they are read as they were.
fn points() -> Vec<[f64; 3]> {
    (0..40).map(|k| [0, 1, 2].map(|a| f64::from((k * (a + 3) * 7) % 32) * 0.125 - 1.5)).collect()
}

#[test]
fn every_version_and_point_format_makes_the_same_map() {
    let spec = spec([-1.0, 1.0]);
    let text: String = points().iter().map(|p| format!("{} {} {}\n", p[0], p[1], p[2])).collect();
    let expected = good("a.xyz", text.as_bytes(), &spec);
    let records = [20, 28, 26, 34, 57, 63, 30, 36, 38, 59, 67];
    for (format, least) in (0..).zip(records) {
        for (minor, more) in [(0, 0), (2, 5), (3, 0), (4, 2)] {
            let las = Las { minor, format, record: least + more, ..USUAL };
            assert_eq!(good("a.LAS", &las.write(&points()), &spec), expected, "1.{minor}, format {format}");
        }
    }
    let followed = [USUAL.write(&points()), b"another kind of record".to_vec()].concat();
    assert_eq!(good("a.las", &followed, &spec), expected);
}

#[test]
fn las_headers_are_checked_before_memory_is_taken() {
    let file = USUAL.write(&points());
    let with = |at: usize, bytes: &[u8]| {
        let mut changed = file.clone();
        changed[at..at + bytes.len()].copy_from_slice(bytes);
        bad("a.las", &changed, &spec([-1.0, 1.0])).remove(0)
    };
    assert_eq!(with(0, b"LAZF").0, "map/format");
    assert_eq!(with(24, &[2]).1, "byte 24 of the LAS header: the version is 2.2, expected 1.0 to 1.4");
    assert_eq!(with(94, &[0, 0]).0, "map/header");
    assert_eq!(with(96, &u32::MAX.to_le_bytes()).0, "map/header");
    assert_eq!(with(104, &[11]).1, "byte 104 of the LAS header: the point format is 11, expected 0 to 10");
    assert_eq!(with(105, &[33, 0]).0, "map/header");
    assert_eq!(with(107, &u32::MAX.to_le_bytes()).0, "map/truncated");
    assert_eq!(with(139, &f64::NAN.to_le_bytes()).0, "map/header");
    assert_eq!(with(131, &0f64.to_le_bytes()).0, "map/header");
    assert_eq!(with(171, &f64::INFINITY.to_le_bytes()).0, "map/header");
    assert_eq!(with(107, &[0; 4]).0, "map/no-points");
    assert_eq!(with(155, &4e8f64.to_le_bytes()).0, "map/far-away");
    for at in [3, 100, 226, file.len() - 1] {
        assert_eq!(bad("a.las", &file[..at], &spec([-1.0, 1.0])).len(), 1);
    }
}

#[cfg(not(feature = "laz"))]
#[test]
fn without_the_feature_a_compressed_file_says_how_to_build_with_it() {
    let file = Las { format: 0x83, ..USUAL }.write(&points());
    let d = parse(&inputs("a.laz", &file), &spec([-1.0, 1.0]), 1.0).expect_err("not built");
    assert_eq!(d.0[0].code, "map/format");
    assert!(d.0[0].hint.as_ref().is_some_and(|h| h.contains("--features laz")), "{d:?}");
}

#[cfg(feature = "laz")]
mod packed {
    use super::*;
    use laz::{LasZipCompressor, LazVlrBuilder};
    use std::io::Cursor;

    fn laz(las: &Las, points: &[[f64; 3]], chunk: u32) -> Vec<u8> {
        let extra = las.record as u16 - [20, 28, 26, 34, 57, 63, 30, 36, 38, 59, 67][usize::from(las.format)];
        let builder = LazVlrBuilder::default().with_point_format(las.format, extra).expect("a point format");
        let layout = builder.with_fixed_chunk_size(chunk).build();
        let mut data = Cursor::new(Vec::new());
        layout.write_to(&mut data).expect("in memory");
        let data = data.into_inner();
        let mut about = vec![0, 0];
        about.extend(b"laszip encoded\0\0");
        about.extend(22204u16.to_le_bytes());
        about.extend((data.len() as u16).to_le_bytes());
        about.resize(54, 0);
        about.extend(data);
        let mut head = Las { format: las.format | 0x80, ..*las }.head(points.len(), &about);
        let start = head.len() as u64;
        let mut out = Cursor::new(std::mem::take(&mut head));
        out.set_position(start);
        let mut packer = LasZipCompressor::new(&mut out, layout).expect("in memory");
        packer.compress_many(&las.records(points)).expect("in memory");
        packer.done().expect("in memory");
        drop(packer);
        out.into_inner()
    }

    #[test]
    fn compressed_points_make_the_same_map() {
        let spec = spec([-1.0, 1.0]);
        for (minor, format, record) in [(2, 0, 20), (2, 1, 28), (2, 3, 36), (4, 6, 30), (4, 7, 38)] {
            let las = Las { minor, format, record, ..USUAL };
            let expected = good("a.las", &las.write(&points()), &spec);
            for chunk in [7, 1000] {
                assert_eq!(good("a.laz", &laz(&las, &points(), chunk), &spec), expected, "format {format}");
            }
        }
    }

    #[test]
    fn damaged_compression_is_refused_and_never_panics() {
        let file = laz(&USUAL, &points(), 7);
        for cut in (0..file.len()).step_by(3) {
            assert!(parse(&inputs("a.laz", &file[..cut]), &spec([-1.0, 1.0]), 1.0).is_err() || cut + 40 > file.len());
        }
        for at in (94..file.len()).step_by(5) {
            for value in [0, 0xff] {
                let mut changed = file.clone();
                changed[at] = value;
                let _ =
                    parse(&inputs("a.laz", &changed), &MapSpec { resolution: Some(100.0), ..spec([-1.0, 1.0]) }, 1.0);
            }
        }
    }
}
