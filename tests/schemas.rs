//! The JSON Schemas that `trajc schema` prints are true to what the program writes and reads.

#[allow(dead_code, reason = "what the tests of the command line need")]
#[path = "cli/sandbox.rs"]
mod sandbox;

use std::fs;

use sandbox::{Sandbox, repository};
use serde_json::{Value, json};

/// A JSON Schema, as far as ours go: a keyword that is not known here fails.
struct Schema {
    root: Value,
    /// Keys that an object's `properties` do not name are faults, unless `additionalProperties` allows them.
    strict: bool,
}

impl Schema {
    fn of(which: &str, strict: bool) -> Self {
        let text = Sandbox::empty().run(&["schema", which]).expect(0).stdout;
        Self { root: serde_json::from_str(&text).expect("JSON"), strict }
    }

    /// All that is wrong with a value.
    fn faults(&self, value: &Value) -> Vec<String> {
        let mut faults = Vec::new();
        self.check(&self.root, value, "$", &mut faults);
        faults
    }

    fn holds(&self, schema: &Value, value: &Value) -> bool {
        let mut faults = Vec::new();
        self.check(schema, value, "$", &mut faults);
        faults.is_empty()
    }

    fn check(&self, schema: &Value, value: &Value, at: &str, faults: &mut Vec<String>) {
        let Some(keywords) = schema.as_object() else {
            assert!(schema.is_boolean(), "{schema}");
            if schema == false {
                faults.push(format!("{at}: nothing is allowed"));
            }
            return;
        };
        for (keyword, says) in keywords {
            if !self.keyword(schema, keyword, says, value, at, faults) {
                faults.push(format!("{at}: {keyword} {says}: {value}"));
            }
        }
        if let Some(object) = value.as_object().filter(|_| schema["properties"].is_object()) {
            let unknown = object.keys().filter(|key| schema["properties"].get(key.as_str()).is_none());
            let allowed = keywords.get("additionalProperties");
            for key in unknown {
                match allowed {
                    Some(Value::Bool(true)) => {}
                    Some(Value::Bool(false)) => faults.push(format!("{at}: unknown key {key}")),
                    Some(inner) => self.check(inner, &object[key], &format!("{at}.{key}"), faults),
                    None if self.strict => faults.push(format!("{at}: {key} is in no schema")),
                    None => {}
                }
            }
        }
    }

    /// Whether a keyword holds; faults of what is inside are told by itself.
    fn keyword(
        &self,
        schema: &Value,
        keyword: &str,
        says: &Value,
        value: &Value,
        at: &str,
        faults: &mut Vec<String>,
    ) -> bool {
        let number =
            |holds: fn(f64, f64) -> bool| value.as_f64().is_none_or(|v| holds(v, says.as_f64().expect("a bound")));
        let length = |holds: fn(u64, u64) -> bool| {
            let own = value.as_array().map(Vec::len).or(value.as_str().map(|s| s.chars().count()));
            own.is_none_or(|own| holds(own as u64, says.as_u64().expect("a length")))
        };
        let choices = || says.as_array().expect("a list of schemas").iter();
        match keyword {
            "$schema" | "$defs" | "title" | "description" | "format" | "default" => true,
            "$ref" => {
                let name = says.as_str().and_then(|r| r.strip_prefix("#/$defs/")).expect("a reference");
                self.check(&self.root["$defs"][name], value, at, faults);
                true
            }
            "type" => match says {
                Value::String(kind) => is(kind, value),
                kinds => kinds.as_array().expect("kinds").iter().any(|kind| is(kind.as_str().expect("a kind"), value)),
            },
            "const" => says == value,
            "enum" => says.as_array().expect("a list").contains(value),
            "anyOf" => choices().any(|choice| self.holds(choice, value)),
            "oneOf" => choices().filter(|choice| self.holds(choice, value)).count() == 1,
            "not" => !self.holds(says, value),
            "minimum" => number(|v, bound| v >= bound),
            "maximum" => number(|v, bound| v <= bound),
            "exclusiveMinimum" => number(|v, bound| v > bound),
            "minItems" | "minLength" => length(|own, bound| own >= bound),
            "maxItems" => length(|own, bound| own <= bound),
            // There are two patterns: degrees and percent.
            "pattern" => {
                let unit = ["deg", "%"]
                    .into_iter()
                    .find(|unit| says.as_str().is_some_and(|p| p.ends_with(&format!("{unit}$"))));
                let unit = unit.unwrap_or_else(|| panic!("{says}"));
                let written = |text: &str| text.strip_suffix(unit).is_some_and(|n| n.parse::<f64>().is_ok());
                value.as_str().is_none_or(written)
            }
            "required" => value.as_object().is_none_or(|object| {
                says.as_array().expect("names").iter().all(|name| object.contains_key(name.as_str().expect("a name")))
            }),
            "items" => {
                for (k, item) in value.as_array().into_iter().flatten().enumerate() {
                    self.check(says, item, &format!("{at}[{k}]"), faults);
                }
                true
            }
            "properties" => {
                for (key, inner) in says.as_object().expect("schemas") {
                    if let Some(own) = value.get(key) {
                        self.check(inner, own, &format!("{at}.{key}"), faults);
                    }
                }
                true
            }
            "additionalProperties" => {
                // Beside `properties` it is looked at with them.
                for (key, own) in value.as_object().into_iter().flatten().filter(|_| schema["properties"].is_null()) {
                    self.check(says, own, &format!("{at}.{key}"), faults);
                }
                true
            }
            other => panic!("keyword `{other}` is not known here"),
        }
    }
}

fn is(kind: &str, value: &Value) -> bool {
    match kind {
        "object" => value.is_object(),
        "array" => value.is_array(),
        "string" => value.is_string(),
        "number" => value.is_number(),
        "integer" => value.as_f64().is_some_and(|v| v.fract() == 0.0),
        "boolean" => value.is_boolean(),
        "null" => value.is_null(),
        other => panic!("kind `{other}`"),
    }
}

fn yaml(text: &str) -> Value {
    serde_saphyr::from_str(text).expect("YAML")
}

#[test]
fn reports_of_every_ending_are_what_the_schema_says() {
    let schema = Schema::of("report", true);
    let sandbox = Sandbox::new();
    let mission = sandbox.text("missions/a.yaml");
    let path = "robot: ../robots/conv/robot.yaml\npath: {bezier: [[[0, 0], [2, 0], [4, 2], [4, 4]]]}\n";
    let bars = "robot: ../robots/scr_db/robot.yaml\nmap: {file: ../maps/first.csv}\nstart: {x_m: 0.6, y_m: 1.5, yaw: 0}\ngoal: {x_m: 0.6, y_m: 1.5}\n";
    let cases = [
        ("certified", mission.clone(), 0),
        ("given", path.to_owned(), 0),
        ("joints", bars.to_owned(), 0),
        ("tolerance", mission.clone() + "tolerance: {track: 1%, wheel_difference: 0.1%}\n", 0),
        ("too_narrow", mission.clone() + "tolerance: {wheel_difference: 0.1}\n", 1),
        ("start_blocked", mission.replace("x_m: 0.6", "x_m: 2.0"), 1),
        ("goal_blocked", mission.replace("x_m: 3.4", "x_m: 2.0"), 1),
        ("off_the_map", mission.replace("x_m: 3.4", "x_m: 30"), 1),
        ("no_way", mission.replace("0.05\nsampling", "0.4\nsampling"), 1),
        ("refused", path.to_owned() + "map: {file: ../maps/first.csv}\n", 1),
    ];
    let mut endings = std::collections::BTreeSet::new();
    for (name, text, code) in cases {
        sandbox.write(&format!("missions/{name}.yaml"), text);
        sandbox.run(&["compile", &format!("missions/{name}.yaml")]).expect(code);
        let report: Value = serde_json::from_slice(&sandbox.read(&format!("out/{name}/report.json"))).expect("JSON");
        assert_eq!(schema.faults(&report), [""; 0], "{name}");
        endings.insert(report["failure"]["code"].as_str().unwrap_or("certified").to_owned());
    }
    assert!(endings.len() >= 4, "{endings:?}");
}

#[test]
fn builds_of_every_ending_are_what_the_schema_says() {
    let schema = Schema::of("build", true);
    let sandbox = Sandbox::new();
    sandbox.write("missions/b.yaml", sandbox.text("missions/a.yaml").replace("x_m: 3.4", "x_m: 2.0"));
    sandbox.write("missions/c.yaml", "robot: 3\n");
    let mut seen = std::collections::BTreeSet::new();
    for (args, code) in [(&["-n"][..], 0), (&["-k"], 2), (&["-k"], 2), (&[], 1)] {
        let run = sandbox.run(&[&["build", "--json"], args].concat()).expect(code);
        let document: Value = serde_json::from_str(&run.stdout).expect("JSON");
        assert_eq!(schema.faults(&document), [""; 0], "{args:?}");
        let rows = document["missions"].as_array().expect("missions").clone();
        seen.extend(rows.iter().map(|row| row["status"].as_str().expect("a word").to_owned()));
    }
    let all = ["certified", "failed", "failed_before", "not_tried", "to_compile", "up_to_date"];
    assert!(seen.iter().eq(&all), "{seen:?}");
}

#[test]
fn the_schema_of_reports_refuses_what_is_no_report() {
    let schema = Schema::of("report", true);
    let sandbox = Sandbox::compiled();
    let good: Value = serde_json::from_slice(&sandbox.read("out/a/report.json")).expect("JSON");
    assert_eq!(schema.faults(&good), [""; 0]);
    let changed = |pointer: &str, value: Value| {
        let mut report = good.clone();
        *report.pointer_mut(pointer).unwrap_or_else(|| panic!("{pointer}")) = value;
        schema.faults(&report)
    };
    assert!(!changed("/status", json!("perhaps")).is_empty());
    assert!(!changed("/certificate/limits_hold", json!("yes")).is_empty());
    assert!(!changed("/limits/0/actuator", json!(3)).is_empty());
    assert!(!changed("/map/dims", json!([1, 2])).is_empty());
    assert!(!changed("/commands", json!({"rows": 3})).is_empty());
    assert_eq!(changed("/inputs/mission", json!({"path": "a", "blake3": "b", "size": 1})).len(), 1);
}

#[test]
fn missions_and_robots_that_are_shipped_are_what_the_schemas_say() {
    for (which, files) in [("mission", "missions"), ("robot", "robots")] {
        let schema = Schema::of(which, false);
        let mut seen = 0;
        for entry in fs::read_dir(repository().join(files)).expect("shipped") {
            let path = entry.expect("an entry").path();
            let path = if path.is_dir() { path.join("robot.yaml") } else { path };
            let text = fs::read_to_string(&path).unwrap_or_else(|e| panic!("{}: {e}", path.display()));
            assert_eq!(schema.faults(&yaml(&text)), [""; 0], "{}", path.display());
            seen += 1;
        }
        assert!(seen >= 3, "{seen}");
    }
}

#[test]
fn what_the_program_refuses_for_its_form_the_schema_refuses_too() {
    let sandbox = Sandbox::new();
    let schema = Schema::of("mission", false);
    let good = sandbox.text("missions/a.yaml");
    assert_eq!(schema.faults(&yaml(&good)), [""; 0]);
    for (from, to) in [
        ("clearance_m", "clearence_m"),
        ("clearance_m: 0.05", "clearance_m: -1"),
        ("clearance_m: 0.05", "clearance_m: near"),
        ("yaw: 0deg}\nclear", "yaw: 0 deg}\nclear"),
        ("sampling_time_s: 0.1", "sampling_time_s: 100"),
        ("robot: ../robots/box_base/robot.yaml\n", ""),
        ("map:\n", "via: []\nmap:\n"),
    ] {
        assert!(good.contains(from), "{from}");
        let text = good.replace(from, to);
        sandbox.write("missions/b.yaml", &text);
        sandbox.run(&["compile", "missions/b.yaml"]).expect(2);
        assert!(!schema.faults(&yaml(&text)).is_empty(), "{to}");
    }
}
