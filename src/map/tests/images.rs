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
    assert_eq!(faults("-1.0, 2.0, 0.0", "1"), ["map/origin"]);
    assert_eq!(faults("-1.0", ".nan"), ["map/origin"]);
    assert_eq!(faults("resolution: 0.1", "resolution: 0"), ["map/resolution"]);
    assert_eq!(faults("0.65", "65"), ["map/header"]);
    assert_eq!(faults("negate", "mode: gray\nnegate"), ["map/mode"]);
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
    let sheet = SHEET.replace("0.0]", ".inf]");
    let inputs = MapInputs { name: "maps/a.yaml", bytes: sheet.as_bytes(), beside: Some(("a.pgm", IMAGE)) };
    let d = parse(&inputs, &spec([0.0, 0.3]), 1.0).expect_err("not finite");
    let at = d.0[0].at.as_ref().expect("a place");
    assert_eq!(&at.source.text[at.range.clone()], "[-1.0, 2.0, .inf]");
}

#[test]
fn scale_and_raw_take_for_an_obstacle_what_is_seen_and_not_free() {
    let gradient: Vec<u8> = b"P5 256 1 255\n".iter().copied().chain(0..=255).collect();
    let count = |sheet: &str, unknown| {
        let map = read(sheet, Some(&gradient), &MapSpec { unknown, ..spec([0.0, 0.1]) }).expect("good");
        (map.occupied_count() - map.statistics.unknown, map.statistics.unknown)
    };
    let scale = SHEET.replace("negate: 0", "negate: 0\nmode: scale");
    // Free: 1 - v/255 < 0.196, so v > 205.02. A grey image without transparency has nothing unknown.
    assert_eq!(count(&scale, Unknown::Occupied), (206, 0));
    assert_eq!(count(&scale, Unknown::Free), (206, 0));
    assert_eq!(count(&scale.replace("negate: 0", "negate: 1"), Unknown::Free), (206, 0));
    let raw = SHEET.replace("negate: 0", "negate: 0\nmode: raw");
    // Per cent: 0 to 19 are free, 20 to 100 obstacles, the 155 values above unknown.
    assert_eq!(count(&raw, Unknown::Occupied), (81, 155));
    assert_eq!(count(&raw, Unknown::Free), (81, 0));
    let first = |sheet: &str| read(sheet, Some(&gradient), &spec([0.0, 0.1])).expect("good").occupied([0, 0, 0]);
    assert!(!first(&raw) && first(&raw.replace("negate: 0", "negate: 1")));
}

#[test]
fn a_turned_origin_turns_the_image_about_its_lower_left_corner() {
    let with = |yaw: &str, unknown| {
        let sheet = SHEET.replace("0.0]", &format!("{yaw}]"));
        read(&sheet, Some(IMAGE), &MapSpec { unknown, ..spec([0.0, 0.1]) }).expect("good")
    };
    // Of 3 x 2 pixels at (-1, 2) the obstacles are the upper left and the lower right one, unknown is the upper right one.
    let quarter = with("1.5707963267948966", Unknown::Occupied);
    assert_eq!((quarter.dims, quarter.statistics.unknown), ([2, 3, 1], 1));
    assert!((quarter.origin[0] + 1.2).abs() < 1e-12 && (quarter.origin[1] - 2.0).abs() < 1e-12);
    assert_eq!(quarter.cells().collect::<Vec<_>>(), [[0, 0, 0], [0, 2, 0], [1, 2, 0]]);
    // By an eighth the corners of the grid are beyond the image.
    let eighth = with("0.7853981633974483", Unknown::Occupied);
    assert_eq!(eighth.dims, [5, 4, 1]);
    assert!(eighth.occupied([0, 0, 0]) && eighth.occupied([4, 3, 0]) && eighth.statistics.unknown > 0);
    let free = with("0.7853981633974483", Unknown::Free);
    assert!(!free.occupied([0, 0, 0]) && free.occupied_count() >= 2);
    for cell in free.cells() {
        assert!(eighth.occupied(cell));
    }
}
