//! What is wrong with a file is said, once, with numbers; nothing panics, nothing is believed.

use super::writers::{Kind, npy, pcd, ply};
use super::*;
use proptest::prelude::*;

fn with_header(from: &str, to: &str) -> Vec<u8> {
    let file = pcd(&cloud(), Kind::Little);
    let at = file.windows(from.len()).position(|w| w == from.as_bytes()).expect(from);
    [&file[..at], to.as_bytes(), &file[at + from.len()..]].concat()
}

#[test]
fn other_formats_are_named_with_what_is_read() {
    for (name, word) in [("a.e57", ".las"), ("a.stl", ".ply"), ("a", ".csv")] {
        let d = parse(&inputs(name, b""), &spec([0.0, 1.0]), 1.0).expect_err(name);
        assert_eq!(d.0[0].code, "map/format");
        assert!(d.0[0].hint.as_ref().is_some_and(|h| h.contains(word)), "{d:?}");
    }
    assert_eq!(code("a.pgm", b"P5"), "map/format");
}

#[test]
fn a_truncated_pcd_says_what_was_promised_and_what_is_there() {
    let file = pcd(&cloud(), Kind::Little);
    let n = cloud().len();
    let faults = bad("a.pcd", &file[..file.len() - 1], &spec([0.02, 1.0]));
    let (promised, there) = (n * 23, n * 23 - 1);
    let message = format!("truncated: {n} points promised ({promised} bytes), but only {there} bytes are there");
    assert_eq!(faults, [("map/truncated", message)]);
}

#[test]
fn lying_pcd_headers_are_refused_before_memory_is_taken() {
    let n = cloud().len();
    let points = format!("WIDTH {n}\nHEIGHT 1\nVIEWPOINT 0 0 0 1 0 0 0\nPOINTS {n}");
    for (lie, expected) in [
        ("WIDTH 1000000000000000000\nHEIGHT 1\nPOINTS 1000000000000000000", "map/truncated"),
        ("WIDTH 18446744073709551615\nHEIGHT 1\nPOINTS 18446744073709551615", "map/truncated"),
        ("WIDTH 18446744073709551615\nHEIGHT 2", "map/header"),
        ("WIDTH 5\nHEIGHT 5\nPOINTS 24", "map/header"),
        ("WIDTH 3\nHEIGHT 1\nPOINTS 3", "map/surplus"),
        ("WIDTH -3\nHEIGHT 1\nPOINTS 3", "map/header"),
        ("VERSION 0.7", "map/header"),
    ] {
        let faults = bad("a.pcd", &with_header(&points, lie), &spec([0.0, 1.0]));
        assert_eq!(faults[0].0, expected, "{lie}: {faults:?}");
    }
    let counts = with_header("COUNT 1 1 1 3 1", "COUNT 1 1 1 18446744073709551615 1");
    assert_eq!(code("a.pcd", &counts), "map/truncated");
}

#[test]
fn faults_in_a_pcd_header_are_found_together_with_their_lines() {
    let text = "FIELDS x y q\nSIZE 4 4 3\nTYPE F F\nCOUNT 1 0 1\nPOITNS 3\nDATA text\n";
    let d = parse(&inputs("a.pcd", text.as_bytes()), &spec([0.0, 1.0]), 1.0).expect_err("bad");
    let shown: Vec<&str> =
        d.0.iter().filter_map(|d| d.at.as_ref()).map(|at| &at.source.text[at.range.clone()]).collect();
    assert_eq!(shown, ["POITNS 3", "TYPE F F", "DATA text"], "{d:?}");
    assert_eq!(d.0[0].hint.as_deref(), Some("did you mean `POINTS`?"));
    let text = "FIELDS x y q\nSIZE 4 4 4\nTYPE F F F\nPOINTS 0\nDATA ascii\n";
    assert_eq!(code("a.pcd", text.as_bytes()), "map/no-coordinate");
    assert_eq!(code("a.pcd", b"\x00\x01 not a cloud\n"), "map/header");
    assert_eq!(code("a.pcd", b"hello\nDATA ascii\n"), "map/header");
}

#[test]
fn faults_in_rows_have_their_line_in_the_file() {
    let head = "FIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nPOINTS 2\nWIDTH 2\nHEIGHT 1\nDATA ascii\n";
    let message = |rows: &str| bad("a.pcd", (head.to_owned() + rows).as_bytes(), &spec([0.0, 1.0])).remove(0).1;
    assert_eq!(message("1 2 3\n\n1 2\n"), "`1 2` has 2 columns, expected 3");
    assert_eq!(message("1 2 3\n1 two 3\n"), "`two` is not a number");
    assert_eq!(message("1 2 3\n"), "2 points promised, but 1 are there");
    assert_eq!(message("1 2 3\n1 2 3\n1 2 3"), "2 points promised, but 3 are there");
    let table = |text: &str| bad("a.csv", text.as_bytes(), &spec([0.0, 1.0])).remove(0);
    assert_eq!(table("x,y,z\n1,2,3\n1,2").1, "`1,2` has 2 columns, expected x, y and z");
    assert_eq!(table("x,y,z\n1,,3\n").1, "an empty cell is not a number");
    assert_eq!(table("1,5;2,5;0,1\n").0, "map/row");
    assert_eq!(table("x,y,height\n1,2,3\n").1, "no column `z`: the header has x, y, height");
    assert_eq!(table("3\n1 2 3\n").0, "map/row");
    let place = |text: &str| {
        let faults = parse(&inputs("a.csv", text.as_bytes()), &spec([0.0, 1.0]), 1.0).expect_err("bad").0;
        let at = faults[0].at.clone().expect("a place");
        (at.source.text[..at.range.start].matches('\n').count() + 1, at.source.text[at.range].to_owned())
    };
    assert_eq!(place("x,y,z\n1,2,3\n\n1twoo,0, two\n"), (4, "1twoo".into()));
    assert_eq!(place("x,y,z\n1,2,3\n\n1,0, two\n"), (4, "two".into()));
    assert_eq!(place("\u{feff}x,y,height\n1,2,3\n"), (1, "x,y,height".into()));
    assert_eq!(place("x,y,z\r\n  1 2\r\n"), (2, "1 2".into()));
    assert_eq!(table("x,y,z\n").0, "map/no-points");
    assert_eq!(table("").0, "map/no-points");
    assert_eq!(table("nan nan nan\n1 inf 0\n").1, "no points: the file has 2, of which 2 are not finite");
}

#[test]
fn damaged_compression_is_found() {
    let mut file = pcd(&cloud(), Kind::Compressed);
    assert_eq!(code("a.pcd", &file[..file.len() - 1]), "map/truncated");
    let at = file.windows(7).position(|w| w == b"pressed").expect("DATA line") + 8;
    file[at + 4] ^= 1;
    assert_eq!(code("a.pcd", &file), "map/header");
    file[at + 4] ^= 1;
    file[at + 8] = 0xFF; // a match before the beginning
    assert_eq!(code("a.pcd", &file), "map/damaged");
}

#[test]
fn ply_headers_are_checked() {
    let head = |middle: &str| format!("ply\n{middle}end_header\n");
    let xyz = "property float x\nproperty float y\nproperty float z\n";
    for (text, expected) in [
        ("plot\n".to_owned(), "map/format"),
        ("ply\nformat ascii 1.0\n".into(), "map/header"),
        (head("format ascii 1.0\n"), "map/header"),
        (head(&format!("element vertex 0\n{xyz}")), "map/header"),
        (head(&format!("format ascii 1.0\nelement vertex 0\n{xyz}")), "map/no-points"),
        (head(&format!("format ascii 1.0\nelement vertex 9999999999999999999\n{xyz}")), "map/truncated"),
        (head(&format!("format binary_little_endian 1.0\nelement vertex 9999999999999999999\n{xyz}")), "map/truncated"),
        (head(&format!("format ascii 1.0\nelement vertex two\n{xyz}")), "map/header"),
        (head("format ascii 1.0\nelement vertex 0\nproperty float x\nproperty float y\n"), "map/no-coordinate"),
        (head(&format!("format ascii 1.0\nelement vertex 0\nproperty real w\n{xyz}")), "map/header"),
        (head(&format!("format ascii 1.0\nelemnt vertex 0\n{xyz}")), "map/header"),
        (head(&format!("format binary_middle 1.0\nelement vertex 0\n{xyz}")), "map/header"),
        (
            head(&format!(
                "format binary_big_endian 1.0\nelement a 9999999999999\nproperty list int int i\nelement vertex 1\n{xyz}"
            )),
            "map/truncated",
        ),
        (head(&format!("format binary_little_endian 1.0\nelement vertex 0\n{xyz}")) + "123456789012", "map/surplus"),
    ] {
        let faults = bad("a.ply", text.as_bytes(), &spec([0.0, 1.0]));
        assert_eq!(faults[0].0, expected, "{text}: {faults:?}");
    }
}

#[test]
fn npy_headers_are_checked() {
    let good_header = npy("<f8", false, &[2, 3], &[0; 48]);
    for (file, expected) in [
        (b"NUMPY".to_vec(), "map/format"),
        (b"\x93NUMPY\x01\x00".to_vec(), "map/header"),
        (b"\x93NUMPY\x09\x00\x00\x00\x00\x00".to_vec(), "map/header"),
        (b"\x93NUMPY\x02\x00\xff\xff\xff\xff{}".to_vec(), "map/truncated"),
        (b"\x93NUMPY\x01\x00\x02\x00{}".to_vec(), "map/header"),
        (good_header[..good_header.len() - 1].to_vec(), "map/truncated"),
        (npy("<f8", false, &[2, 3], &[0; 72]), "map/surplus"),
        (npy("<f8", false, &[u64::MAX, 3], &[0; 48]), "map/truncated"),
        (npy("|u1", false, &[u64::MAX, u64::MAX, u64::MAX], &[0; 48]), "map/truncated"),
        (npy("|u1", false, &[0, 4, 4], &[]), "map/shape"),
        (npy("<f8", false, &[3, 100], &[0; 2400]), "map/shape"),
        (npy("<f8", false, &[6], &[0; 48]), "map/shape"),
        (npy("<f4", false, &[1, 1, 1], &[0; 4]), "map/type"),
        (npy("<c8", false, &[1, 3], &[0; 24]), "map/type"),
        (npy("|b1", false, &[1, 3], &[0; 3]), "map/type"),
        (npy("|O", false, &[1, 3], &[0; 24]), "map/type"),
    ] {
        let faults = bad("a.npy", &file, &spec([0.0, 1.0]));
        assert_eq!(faults[0].0, expected, "{faults:?}");
    }
}

#[test]
fn an_origin_is_for_voxels_only_and_heights_must_be_a_slab() {
    let with = |spec: MapSpec| bad("a.xyz", b"1 1 0.5\n", &spec).remove(0).0;
    assert_eq!(with(MapSpec { origin: Some([0.0; 3]), ..spec([0.0, 1.0]) }), "map/origin");
    assert_eq!(with(spec([1.0, 0.0])), "map/height");
    assert_eq!(with(spec([f64::NAN, 1.0])), "map/height");
}

/// A name, its bytes, and what lies beside it.
type File = (&'static str, Vec<u8>, Option<Vec<u8>>);

/// One good file of every kind.
fn files() -> Vec<File> {
    let points = cloud();
    let rows: Vec<u8> = points.iter().flatten().flat_map(|v| v.to_le_bytes()).collect();
    let table: String = points.iter().map(|p| format!("{},{},{}\n", p[0], p[1], p[2])).collect();
    let sheet = b"image: a.pgm\nresolution: 0.1\norigin: [0, 0, 0]\nnegate: 0\noccupied_thresh: 0.65\n".to_vec();
    vec![
        ("a.pcd", pcd(&points, Kind::Ascii), None),
        ("a.pcd", pcd(&points, Kind::Little), None),
        ("a.pcd", pcd(&points, Kind::Compressed), None),
        ("a.ply", ply(&points, Kind::Ascii, true), None),
        ("a.ply", ply(&points, Kind::Little, false), None),
        ("a.ply", ply(&points, Kind::Big, true), None),
        ("a.csv", format!("x,y,z\n{table}").into_bytes(), None),
        ("a.npy", npy("<f8", false, &[points.len() as u64, 3], &rows), None),
        (
            "a.npy",
            npy("|u1", true, &[3, 4, 5], &[1; 60]),
            Some(b"{\"resolution\": 0.1, \"origin\": [0, 0, 0]}".to_vec()),
        ),
        ("a.las", las::USUAL.write(&points), None),
        ("a.bt", octrees::bt(&octrees::small()), None),
        ("a.ot", octrees::ot(&octrees::small()), None),
        ("a.yaml", sheet.clone(), Some(b"P5 # c\n4 3 255\nabcdefghijkl".to_vec())),
        ("a.yaml", sheet, Some(b"P2 4 3 15 1 2 3 4 5 6 7 8 9 10 11 12".to_vec())),
    ]
}

#[derive(Debug, Clone)]
enum Change {
    Cut(prop::sample::Index),
    Set(prop::sample::Index, u8),
    Insert(prop::sample::Index, u8),
    Remove(prop::sample::Index),
    Double(prop::sample::Index),
}

fn change() -> impl Strategy<Value = Change> {
    use Change::*;
    let index = any::<prop::sample::Index>;
    // Bytes that mean something in headers are likelier to get past the first check.
    let byte = || prop_oneof![any::<u8>(), prop::sample::select(b"0123456789 -.,;:\n'(){}[]#".to_vec())];
    prop_oneof![
        1 => index().prop_map(Cut),
        6 => (index(), byte()).prop_map(|(i, b)| Set(i, b)),
        3 => (index(), byte()).prop_map(|(i, b)| Insert(i, b)),
        2 => index().prop_map(Remove),
        1 => index().prop_map(Double),
    ]
}

fn apply(bytes: &mut Vec<u8>, change: &Change) {
    if bytes.is_empty() {
        return;
    }
    let n = bytes.len();
    match change {
        Change::Cut(i) => bytes.truncate(i.index(n)),
        Change::Set(i, b) => bytes[i.index(n)] = *b,
        Change::Insert(i, b) => bytes.insert(i.index(n), *b),
        Change::Remove(i) => drop(bytes.remove(i.index(n))),
        Change::Double(i) => bytes.extend_from_within(i.index(n)..),
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(1500))]
    #[test]
    fn changed_files_are_read_or_refused_and_never_panic(
        file in prop::sample::select(files()),
        changes in prop::collection::vec(change(), 1..6),
        to_beside in any::<bool>(),
    ) {
        let (name, mut bytes, mut other) = file;
        for change in &changes {
            match &mut other {
                Some(other) if to_beside => apply(other, change),
                _ => apply(&mut bytes, change),
            }
        }
        // Coarse, so that points thrown far off make no large grid.
        let coarse = if name == "a.yaml" || other.is_some() { None } else { Some(100.0) };
        let spec = MapSpec { resolution: coarse, ..spec([-5.0, 5.0]) };
        let _ = beside(name, &bytes);
        let inputs = MapInputs { name, bytes: &bytes, beside: other.as_deref().map(|o| ("beside", o)) };
        match parse(&inputs, &spec, 1.0) {
            Ok(map) => prop_assert!(!map.describe().is_empty()),
            Err(diagnostics) => {
                prop_assert!(!diagnostics.0.is_empty());
                for at in diagnostics.0.iter().filter_map(|d| d.at.as_ref()) {
                    // Places can be quoted.
                    prop_assert!(at.source.text.get(at.range.clone()).is_some());
                }
            }
        }
    }

    #[test]
    fn a_binary_file_cut_anywhere_is_refused(
        file in prop::sample::select(vec![1usize, 2, 5, 7, 8, 9, 10, 11]),
        at in any::<prop::sample::Index>(),
    ) {
        let (name, bytes, other) = files().swap_remove(file);
        let cut = &bytes[..at.index(bytes.len())];
        let inputs = MapInputs { name, bytes: cut, beside: other.as_deref().map(|o| ("beside", o)) };
        // Of the PLY only the last face, which nobody needs, may be missing.
        if name != "a.ply" || cut.len() + 5 < bytes.len() {
            prop_assert!(parse(&inputs, &spec([0.0, 1.0]), 1.0).is_err());
        }
    }
}
