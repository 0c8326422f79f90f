//! `report.html` in a real browser: it opens, shows its drawing, moves when asked and only then, and asks for nothing. Where no Chromium
//! is installed these tests say so and pass; pictures are left in `target/tmp/`.

#[path = "report_page/browser.rs"]
mod browser;
#[allow(dead_code)]
#[path = "cli/sandbox.rs"]
mod sandbox;

use std::path::{Path, PathBuf};

use browser::Browser;
use sandbox::Sandbox;

const DESKTOP: [u32; 2] = [1280, 900];
const PHONE: [u32; 2] = [390, 844];

/// Time that the page shows, s.
fn time(browser: &mut Browser) -> f64 {
    browser.run("document.getElementById('time').valueAsNumber").as_f64().expect("a number")
}

/// Leaves a picture of the whole page for people.
fn keep(browser: &mut Browser, name: &str) {
    let picture = browser.picture();
    let bytes = decoded(&picture);
    assert!(bytes.starts_with(b"\x89PNG"), "a picture");
    std::fs::write(Path::new(env!("CARGO_TARGET_TMPDIR")).join(name), bytes).expect("target/tmp can be written");
}

/// Base 64 as bytes.
fn decoded(text: &str) -> Vec<u8> {
    let digit = |c: u8| match c {
        b'A'..=b'Z' => c - b'A',
        b'a'..=b'z' => c - b'a' + 26,
        b'0'..=b'9' => c - b'0' + 52,
        b'+' => 62,
        _ => 63,
    };
    let digits: Vec<u32> = text.bytes().filter(|c| *c != b'=').map(|c| u32::from(digit(c))).collect();
    let bytes = digits.chunks(4).flat_map(|four| {
        let word = (0..4).fold(0, |word, i| word << 6 | four.get(i).copied().unwrap_or(0));
        word.to_be_bytes()[1..four.len()].to_vec()
    });
    bytes.collect()
}

/// Whether something is so within some seconds: a busy machine draws few frames.
fn soon(browser: &mut Browser, holds: impl Fn(&mut Browser) -> bool) -> bool {
    (0..50).any(|_| {
        browser.wait(400);
        holds(browser)
    })
}

/// Nothing went wrong in the page, and it asked for nothing but itself.
fn in_order(browser: &Browser) {
    assert_eq!(browser.errors, [""; 0]);
    let foreign: Vec<_> =
        browser.requests.iter().filter(|url| !url.starts_with("file:") && !url.starts_with("data:")).collect();
    assert!(
        foreign.is_empty()
            && browser.requests.iter().all(|url| !url.starts_with("file:") || url.contains("report.html")),
        "{:?}",
        browser.requests
    );
}

/// A sandbox with the arch bridges' report, under a name that HTML must not mistake for its own.
fn arch_bridges() -> (Sandbox, PathBuf) {
    let sandbox = Sandbox::new();
    sandbox.ship("maps/arch_bridges.pcd");
    sandbox.ship("missions/arch_bridges.yaml");
    let mission = sandbox.text("missions/arch_bridges.yaml");
    sandbox.write("missions/a<b>&'c.yaml", mission);
    sandbox.run(&["compile", "missions/a<b>&'c.yaml"]).expect(0);
    let page = sandbox.path("out/a<b>&'c/report.html");
    (sandbox, page)
}

#[test]
fn a_report_opens_and_moves_when_asked_and_only_then() {
    let Some(mut browser) = Browser::start(true) else { return };
    let (_sandbox, page) = arch_bridges();
    browser.open(&page, DESKTOP, "light");
    assert_eq!(browser.run("document.querySelector('h1').innerText"), "a<b>&'c");
    assert_eq!(browser.run("Boolean(document.getElementById('canvas').getContext('webgl'))"), true);

    let still = browser.drawing();
    browser.wait(600);
    assert!(still == browser.drawing(), "nothing moves by itself");

    browser.click("#time", 0.75);
    let end = browser.run("Number(document.getElementById('time').max)").as_f64().expect("a number");
    assert!((time(&mut browser) / end - 0.75).abs() < 0.05);
    assert!(still != browser.drawing(), "the robot is elsewhere");
    let before = time(&mut browser);
    browser.key("ArrowRight", 39);
    assert!((time(&mut browser) - before - 0.1).abs() < 1e-6, "the keyboard moves it by a row");

    browser.click("#play", 0.5);
    assert!(soon(&mut browser, |b| time(b) > before + 0.3), "it does not play from {before} on");
    browser.click("#play", 0.5);
    let held = time(&mut browser);
    browser.wait(400);
    assert_eq!(time(&mut browser), held, "it stops when asked");

    browser.run("document.querySelector('#limits a[href^=\"#t=\"]').click()");
    browser.wait(200);
    let asked = browser.run("Number(location.hash.slice(3))").as_f64().expect("a number");
    assert!((time(&mut browser) - asked).abs() < 0.051, "a time in a table leads to its instant");

    let seen = browser.drawing();
    browser.run("document.getElementById('canvas').focus()");
    browser.key("ArrowLeft", 37);
    assert!(soon(&mut browser, |b| seen != b.drawing()), "keys turn the view");
    keep(&mut browser, "report_light.png");
    in_order(&browser);
}

#[test]
fn a_report_is_readable_in_the_dark_on_a_phone_and_on_paper() {
    let Some(mut browser) = Browser::start(true) else { return };
    let (_sandbox, page) = arch_bridges();
    let shade =
        "getComputedStyle(document.body).backgroundColor.match(/\\d+/g).map(Number).reduce((a, b) => a + b) / 765";
    for (scheme, dark) in [("light", false), ("dark", true)] {
        browser.open(&page, DESKTOP, scheme);
        let found = browser.run(shade).as_f64().expect("a number");
        assert!(if dark { found < 0.2 } else { found > 0.9 }, "{scheme}: {found}");
    }
    keep(&mut browser, "report_dark.png");
    let printed = browser.call("Page.printToPDF", serde_json::json!({"printBackground": true}));
    assert!(decoded(printed["data"].as_str().expect("a document")).starts_with(b"%PDF"));
    browser.open(&page, PHONE, "light");
    assert_eq!(browser.run("document.documentElement.scrollWidth"), 390, "nothing sticks out");
    keep(&mut browser, "report_phone.png");
    in_order(&browser);
}

#[test]
fn a_browser_without_webgl_shows_the_motion_from_above() {
    let Some(mut browser) = Browser::start(false) else { return };
    let (_sandbox, page) = arch_bridges();
    browser.open(&page, DESKTOP, "light");
    let still = browser.drawing();
    browser.click("#time", 0.5);
    assert!(still != browser.drawing());
    keep(&mut browser, "report_plan.png");
    in_order(&browser);
}

#[test]
fn the_report_of_a_mission_that_failed_opens_too() {
    let Some(mut browser) = Browser::start(true) else { return };
    let sandbox = Sandbox::new();
    sandbox.edit("missions/a.yaml", "goal: {x_m: 3.4", "goal: {x_m: 2.0");
    sandbox.run(&["compile", "missions/a.yaml"]).expect(1);
    browser.open(&sandbox.path("out/a/report.html"), DESKTOP, "light");
    let text = browser.run("document.body.innerText");
    let text = text.as_str().expect("text");
    for said in ["failed", "the goal is in collision", "Nearest free pose"] {
        assert!(text.contains(said), "{said}");
    }
    let far = browser.drawing();
    browser.run("[...document.querySelectorAll('#places button')].find(b => b.innerText === 'goal').click()");
    browser.wait(200);
    assert!(far != browser.drawing(), "it looks at the goal");
    keep(&mut browser, "report_failed.png");
    in_order(&browser);
}
