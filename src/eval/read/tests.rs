//! A table of faults: the text replaced in a good file, and what the message must say.

use super::*;

const GOOD: &str = r#"{"schema": "trajc.scenes/1", "name": "mine", "seed": 1,
  "bounds": [[0, 0, 0], [4, 3, 1]], "resolution": 0.05, "clearance_m": 0.03, "reverse": true,
  "limits": {"wheel": {"speed_mps": 1.0}, "base": {"eta": 0.4}, "joints": {"blade": {"jerk": 15}}},
  "scenes": [{"id": "a", "kind": "hall", "boxes": [{"min": [1, 1, 0], "max": [1.6, 1.6, 0.4]}],
    "start": {"x": 0.5, "y": 0.5, "yaw": 0}, "goal": {"x": 3, "y": 2, "yaw": 1.5, "joints": {"blade": 0.25}}}]}"#;

#[test]
fn a_good_file_says_what_it_says() {
    let set = read("s.json", GOOD).expect("good");
    assert_eq!((set.name.as_str(), set.resolution, set.clearance, set.reverse), ("mine", 0.05, 0.03, true));
    assert_eq!(set.bounds, Aabb { min: [0.0; 3], max: [4.0, 3.0, 1.0] });
    assert_eq!((set.limits.wheel.speed, set.limits.base.eta), (Some(1.0), Some(0.4)));
    assert_eq!(set.limits.joints["blade"].jerk, Some(15.0));
    let scene = &set.scenes[0];
    assert_eq!(scene.kind.as_deref(), Some("hall"));
    assert_eq!(scene.boxes, [Aabb { min: [1.0, 1.0, 0.0], max: [1.6, 1.6, 0.4] }]);
    assert_eq!((scene.start.x, scene.goal.yaw, scene.goal.joints["blade"]), (Some(0.5), Some(1.5), 0.25));
    assert!(scene.start.joints.is_empty());
    let voxels = set.voxels(scene).expect("small");
    assert_eq!((voxels.dims, voxels.occupied_count()), ([80, 60, 20], 12 * 12 * 8));
}

#[test]
fn what_is_left_out_has_the_defaults_of_a_mission() {
    let text = r#"{"schema": "trajc.scenes/1", "bounds": [[0,0,0],[4,3,1]], "resolution": 0.05, "scenes":
        [{"id": "a", "boxes": [], "start": {"x":1,"y":1,"yaw":0}, "goal": {"x":1,"y":1,"yaw":0}, "passage_radius": 1}]}"#;
    let set = read("s.json", text).expect("good");
    assert_eq!((set.clearance, set.reverse, set.limits.clone()), (0.05, false, LimitsSpec::default()));
    assert_eq!(set.scenes[0].kind, None);
    let mission = set.mission(&set.scenes[0]);
    assert_eq!((mission.sampling_time, mission.clearance), (0.1, 0.05));
}

#[test]
fn every_fault_is_named_with_its_place() {
    let table: &[(&str, &str, &str)] = &[
        ("\"seed\": 1,", "\"seed\": 1", "not JSON"),
        ("trajc.scenes/1", "trajc.scenes/2", "`schema` is \"trajc.scenes/2\""),
        ("\"schema\": \"trajc.scenes/1\", ", "", "`schema` is missing"),
        ("\"resolution\": 0.05, ", "", "`resolution` is missing"),
        ("\"resolution\": 0.05", "\"resolution\": 0", "`resolution` must be between"),
        ("\"resolution\": 0.05", "\"resolution\": 0.0002", "larger `resolution`"),
        ("\"clearance_m\"", "\"clearance\"", "unknown key `clearance`"),
        ("\"reverse\": true", "\"reverse\": \"yes\"", "`reverse` must be true or false, found \"yes\""),
        ("\"reverse\": true", "\"reverse\": true, \"reverse\": false", "`reverse` is given twice"),
        ("[4, 3, 1]", "[4, 0, 1]", "`bounds`: lower corner 0 is not below upper corner 0 along y"),
        ("\"speed_mps\": 1.0", "\"speed_mps\": -1.0", "`limits.wheel.speed_mps` must be"),
        ("\"eta\"", "\"etta\"", "unknown key `etta` in `limits.base`"),
        ("[1, 1, 0]", "[1, 1]", "`scenes[0].boxes[0].min` must be [x, y, z] in metres, found a list of 2"),
        ("[1, 1, 0]", "[2, 1, 0]", "`scenes[0].boxes[0]`: lower corner 2"),
        ("[1, 1, 0]", "[1, 1, 1e400]", "not JSON"),
        ("[1, 1, 0]", "[1, 1, 1e300]", "`scenes[0].boxes[0].min[2]` must be between"),
        (", \"yaw\": 0}", "}", "`scenes[0].start.yaw` is missing"),
        ("\"x\": 0.5", "\"x\": \"0.5\"", "`scenes[0].start.x` must be a number"),
        ("\"id\": \"a\"", "\"id\": \"../a\"", "`scenes[0].id`: \"../a\" cannot be"),
        ("\"id\": \"a\"", "\"id\": 7", "`scenes[0].id` must be text, found 7"),
        ("\"kind\": \"hall\"", "\"kind\": [1]", "`scenes[0].kind` must be text, found a list of 1"),
        ("{\"blade\": 0.25}", "[0.25]", "`scenes[0].goal.joints` must be"),
    ];
    for (from, to, expected) in table {
        let text = GOOD.replacen(from, to, 1);
        assert_ne!(text, GOOD, "{from}");
        let faults = read("s.json", &text).expect_err(expected);
        let said: Vec<String> = faults.0.iter().map(|d| format!("{} {:?}", d.message, d.hint)).collect();
        assert!(said.iter().any(|m| m.contains(expected)), "{expected}: {said:?}");
        let placed = |d: &Diagnostic| d.at.as_ref().is_some_and(|at| at.source.text == text && !at.range.is_empty());
        assert!(faults.0.iter().all(|d| placed(d) && d.hint.is_some()), "{faults:?}");
    }
}

#[test]
fn an_empty_list_and_a_name_given_twice_are_faults() {
    let at = GOOD.find("[{\"id\"").expect("there");
    let empty = format!("{}[]}}", &GOOD[..at]);
    assert!(read("s.json", &empty).expect_err("empty").0[0].message.contains("`scenes` must be a list of 1"));
    let scene = &GOOD[at + 1..GOOD.len() - 2];
    let twice = format!("{}[{scene}, {scene}]}}", &GOOD[..at]);
    assert!(read("s.json", &twice).expect_err("twice").0[0].message.starts_with("`scenes[1].id`: another scene"));
}

#[test]
fn a_file_full_of_faults_says_the_first_hundred() {
    let text = GOOD.replacen("{\"id\": \"a\"", &format!("{}{{\"id\": \"a\"", "7, ".repeat(5000)), 1);
    assert_eq!(read("s.json", &text).expect_err("numbers are no scenes").0.len(), 100);
}
