//! Mistakes in files of scenes for `eval`.

use super::case::{Case, Why, case};

const FILE: &str = "s.json";
const ROBOT: &str = "robots/box_base/robot.yaml";
const GOOD: &str = r#"{
  "schema": "trajc.scenes/1",
  "bounds": [[-1, -1, 0], [3, 2, 0.4]],
  "resolution": 0.05,
  "scenes": [
    {
      "id": "ahead",
      "boxes": [{"min": [1, 1, 0], "max": [1.2, 1.2, 0.4]}],
      "start": {"x": 0, "y": 0, "yaw": 0},
      "goal": {"x": 1.5, "y": 0, "yaw": 0}
    }
  ]
}
"#;

fn scenes(name: &'static str, from: &'static str, to: &'static str) -> Case {
    case(name).write(FILE, GOOD).edit(FILE, from, to).run(&["eval", "--scenes", FILE, "--robot", ROBOT])
}

pub fn cases() -> Vec<Case> {
    vec![
        scenes("not_json", "\"resolution\": 0.05,", "resolution: 0.05,").at(FILE, "|resolution: 0.05").found("`resolution: 0.05,`")
            .expected("key must be a string").hint("in quotes"),
        scenes("comma", "\"resolution\": 0.05,", "\"resolution\": 0.05").at(FILE, "|\"scenes\"").found("`\"scenes\"").expected("`,` or `}`")
            .hint("a comma"),
        scenes("cut", "\n    }\n  ]\n}\n", "").found("the end of the file").expected("`}`").hint("cut off")
            .at(FILE, "\"goal\": {\"x\": 1.5, \"y\": 0, \"yaw\": 0}|"),
        scenes("schema", "scenes/1", "scenes/9").at(FILE, "\"trajc.scenes/9\"").found("\"trajc.scenes/9\"").expected("\"trajc.scenes/1\"")
            .hint("scenes begin with"),
        scenes("missing", "      \"id\": \"ahead\",\n", "").at(FILE, "    |{\n").nothing_found(Why::Missing).expected("`scenes[0].id`")
            .hint("\"id\": "),
        scenes("key_near", "\"resolution\"", "\"resolutoin\"").at(FILE, "\"resolutoin\"").found("`resolutoin`").expected("`resolution`")
            .hint("did you mean `resolution`?"),
        scenes("key_far", "\"id\"", "\"colour\": 1, \"id\"").at(FILE, "\"colour\"").found("`scenes[0].colour`").expected("known here")
            .hint("passage_radius"),
        scenes("key_twice", "\"yaw\": 0},\n", "\"yaw\": 0, \"yaw\": 1},\n").at(FILE, "0, |\"yaw\": 1").found("`scenes[0].start.yaw`")
            .expected("twice").hint("keep one of the two"),
        scenes("kind", "\"resolution\": 0.05", "\"resolution\": \"fine\"").at(FILE, "\"fine\"").found("\"fine\"").expected("a number")
            .hint("\"resolution\": 0.05"),
        scenes("range", "\"resolution\": 0.05", "\"resolution\": 50").at(FILE, "50").found("50").expected("between 0.0001 and 10")
            .hint("metres"),
        scenes("point", "[1, 1, 0]", "[1, 1]").at(FILE, "[1, 1]").found("a list of 2").expected("[x, y, z] in metres").hint("[1, 1, 0]"),
        scenes("upside_down", "\"max\": [1.2, 1.2, 0.4]", "\"max\": [0.2, 1.2, 0.4]").at(FILE, "{\"min\"").found("lower corner 1")
            .expected("upper corner 0.2").hint("`min` before `max`"),
        scenes("id", "\"ahead\"", "\"a/b\"").at(FILE, "\"a/b\"").found("\"a/b\"").expected("name of a folder").hint("letters, digits"),
        scenes("joint", "\"yaw\": 0},\n", "\"yaw\": 0, \"joints\": {\"blade\": 0}},\n").at(FILE, "\"blade\": 0").found("`scenes[0].start.joints.blade`")
            .expected("moves no joint of that name").hint("no moving joint"),
        scenes("no_scenes", "[\n    {\n      \"id\": \"ahead\",\n      \"boxes\": [{\"min\": [1, 1, 0], \"max\": [1.2, 1.2, 0.4]}],\n      \"start\": {\"x\": 0, \"y\": 0, \"yaw\": 0},\n      \"goal\": {\"x\": 1.5, \"y\": 0, \"yaw\": 0}\n    }\n  ]", "[]")
            .at(FILE, "[]").found("found 0").expected("1 to 20000 scenes").hint("at least one"),
        scenes("limits", "\"resolution\"", "\"limits\": {\"wheel\": {\"acceleration_mps2\": -1}}, \"resolution\"")
            .at(FILE, "mps2\": |-1").found("`-1`").expected("greater than 0 m/s^2").hint("greatest acceleration"),
        scenes("grid", "[3, 2, 0.4]]", "[900000, 900000, 0.4]]").at(FILE, "[[-1, -1").found("cells of 0.05 m").expected("can be handled")
            .hint("a larger `resolution`"),
        scenes("file_missing", "0.05", "0.05").run(&["eval", "--scenes", "s.jsno", "--robot", ROBOT]).in_file("s.jsno", Why::WholeFile)
            .found("`s.jsno`").expected("no such file").hint("s.json"),
    ]
}
