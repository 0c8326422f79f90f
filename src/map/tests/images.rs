//! map_server sheets and images.

use super::*;

const SHEET: &str =
    "image: a.pgm\nresolution: 0.1\norigin: [-1.0, 2.0, 0.0]\nnegate: 0\noccupied_thresh: 0.65\nfree_thresh: 0.196\n";

fn read(sheet: &str, image: Option<&[u8]>, spec: &MapSpec) -> Result<VoxelMap, Vec<&'static str>> {
    let inputs = MapInputs { name: "maps/a.yaml", bytes: sheet.as_bytes(), beside: image.map(|i| ("maps/a.pgm", i)) };
    parse(&inputs, spec, 0.45).map_err(|d| d.0.iter().map(|d| d.code).collect())
}

/// Black, white and unknown above; white, white, black below.
const IMAGE: &[u8] = b"P5 3 2 255\n\x00\xfe\xcd\xff\xff\x05";

#[test]
fn pixels_fill_from_the_floor_to_the_top_with_the_top_row_at_the_largest_y() {
    let map = read(SHEET, Some(IMAGE), &spec([0.05, 0.3])).expect("good");
    assert_eq!((map.dims, map.origin, map.resolution), ([3, 2, 3], [-1.0, 2.0, 0.0], 0.1));
    let columns: Vec<[usize; 3]> = map.cells().filter(|c| c[2] == 0).collect();
    assert_eq!(columns, [[0, 1, 0], [2, 0, 0], [2, 1, 0]]);
    assert_eq!(map.occupied_count(), 9);
    assert_eq!(map.statistics.unknown, 3);
}

#[test]
fn unknown_pixels_are_free_where_the_mission_says_so() {
    let map = read(SHEET, Some(IMAGE), &MapSpec { unknown: Unknown::Free, ..spec([0.05, 0.3]) }).expect("good");
    assert_eq!((map.occupied_count(), map.statistics.unknown, map.outside), (6, 0, Unknown::Free));
}

#[test]
fn without_a_height_columns_reach_the_robots_top_and_below_the_floor_where_asked() {
    let map = read(SHEET, Some(IMAGE), &MapSpec { height: None, ..spec([0.0, 0.0]) }).expect("good");
    assert_eq!((map.dims[2], map.origin[2]), (5, 0.0));
    let map = read(SHEET, Some(IMAGE), &spec([-0.25, 0.3])).expect("good");
    assert_eq!((map.dims[2], map.origin[2]), (6, -0.25));
    // As tall as any robot, not as tall as the number.
    assert_eq!(read(SHEET, Some(IMAGE), &spec([0.0, 1e9])).expect("good").dims[2], 100);
}

#[test]
fn thresholds_and_negation_decide() {
    let gradient: Vec<u8> = b"P5 256 1 255\n".iter().copied().chain(0..=255).collect();
    let count = |sheet: &str| {
        let map = read(sheet, Some(&gradient), &spec([0.0, 0.1])).expect("good");
        (map.occupied_count() - map.statistics.unknown, map.statistics.unknown)
    };
    // Occupied: 1 - v/255 > 0.65, so v < 89.25; unknown: 1 - v/255 >= 0.196, so v <= 205.02.
    assert_eq!(count(SHEET), (90, 116));
    assert_eq!(count(&SHEET.replace("negate: 0", "negate: 1")), (90, 116));
    assert_eq!(count(&SHEET.replace("negate: 0", "negate: true")), (90, 116));
    assert_eq!(count(&SHEET.replace("0.65", "0.5").replace("0.196", "0.5")), (128, 0));
    let short = "image: a.pgm\nresolution: 1e-1\norigin: [0, 0]\n";
    assert_eq!(count(short), (90, 116));
    assert_eq!(count(&(SHEET.to_owned() + "mode: trinary\nnote: from another tool\n")), (90, 116));
}

#[test]
fn sheets_are_checked() {
    let faults = |from: &str, to: &str| read(&SHEET.replace(from, to), Some(IMAGE), &spec([0.0, 0.3])).expect_err(to);
    assert_eq!(faults("0.0]", "0.5]"), ["map/turned"]);
    assert_eq!(faults("-1.0, 2.0, 0.0", "1"), ["map/origin"]);
    assert_eq!(faults("-1.0", ".nan"), ["map/origin"]);
    assert_eq!(faults("resolution: 0.1", "resolution: 0"), ["map/resolution"]);
    assert_eq!(faults("0.65", "65"), ["map/header"]);
    assert_eq!(faults("negate", "mode: scale\nnegate"), ["map/mode"]);
    assert_eq!(
        faults("resolution: 0.1\norigin: [-1.0, 2.0, 0.0]", "resolution: -1\norigin: []"),
        ["map/resolution", "map/origin"]
    );
    assert_eq!(faults("image: a.pgm", "picture: a.pgm"), ["map/description"]);
    assert_eq!(faults("[-1.0, 2.0, 0.0]", "[[["), ["map/description"]);
    assert_eq!(read(SHEET, None, &spec([0.0, 0.3])), Err(vec!["map/no-image"]));
    assert_eq!(read(SHEET, Some(b"\x89PNG"), &spec([0.0, 0.3])), Err(vec!["map/format"]));
    assert_eq!(read(SHEET, Some(&IMAGE[..15]), &spec([0.0, 0.3])), Err(vec!["map/truncated"]));
    let differs = MapSpec { resolution: Some(0.05), ..spec([0.0, 0.3]) };
    assert_eq!(read(SHEET, Some(IMAGE), &differs), Err(vec!["map/resolution-differs"]));
    let same = MapSpec { resolution: Some(0.1), ..spec([0.0, 0.3]) };
    assert!(read(SHEET, Some(IMAGE), &same).is_ok());
}

#[test]
fn a_fault_in_a_sheet_is_quoted() {
    let sheet = SHEET.replace("0.0]", "0.5]");
    let inputs = MapInputs { name: "maps/a.yaml", bytes: sheet.as_bytes(), beside: Some(("a.pgm", IMAGE)) };
    let d = parse(&inputs, &spec([0.0, 0.3]), 1.0).expect_err("turned");
    let at = d.0[0].at.as_ref().expect("a place");
    assert_eq!(&at.source.text[at.range.clone()], "[-1.0, 2.0, 0.5]");
}
