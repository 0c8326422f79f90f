//! `trajc build`: what it compiles and what it leaves alone, what it says, what it leaves behind.

#[path = "build/batch.rs"]
mod batch;
#[path = "build/engines.rs"]
mod engines;
#[allow(dead_code, reason = "what the tests of the command line need")]
#[path = "cli/sandbox.rs"]
mod sandbox;
#[path = "build/up_to_date.rs"]
mod up_to_date;

use sandbox::Sandbox;
use serde_json::Value;

/// The document of a build.
fn built(sandbox: &Sandbox, args: &[&str], code: i32) -> Value {
    let run = sandbox.run(&[&["build", "--json"], args].concat()).expect(code);
    serde_json::from_str(&run.stdout).expect("JSON")
}

/// The missions of one status.
fn of_status(document: &Value, status: &str) -> Vec<String> {
    let rows = document["missions"].as_array().expect("missions").iter();
    rows.filter(|row| row["status"] == status).map(|row| row["mission"].as_str().expect("a name").to_owned()).collect()
}

/// What the next build would compile, by name, and why.
fn to_do(sandbox: &Sandbox) -> Vec<(String, String)> {
    let run = sandbox.run(&["build", "-nk", "--json"]);
    let document: Value = serde_json::from_str(&run.stdout).unwrap_or_else(|e| panic!("{e}: {}", run.stderr));
    let rows = document["missions"].as_array().expect("missions").iter().filter(|row| row["status"] == "to_compile");
    let why = |row: &Value| {
        let why = row["why"].as_array().expect("reasons").iter().map(|w| w.as_str().expect("text"));
        (row["mission"].as_str().expect("a name").to_owned(), why.collect::<Vec<_>>().join("; "))
    };
    rows.map(why).collect()
}

/// A mission on `maps/first.csv` that ends at this y.
fn mission(sandbox: &Sandbox, name: &str, y: f64) {
    let text = sandbox.text("missions/a.yaml");
    let text = text.replace("goal: {x_m: 3.4, y_m: 1.5", &format!("goal: {{x_m: 3.4, y_m: {y}"));
    sandbox.write(&format!("missions/{name}.yaml"), text);
}
