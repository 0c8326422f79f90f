//! A headless Chromium of our own, driven over its DevTools protocol through a pipe.

use std::io::{BufRead, BufReader, Write};
use std::path::Path;
use std::process::{Child, ChildStdin, Command, Stdio};
use std::sync::mpsc::{Receiver, RecvTimeoutError, channel};
use std::time::{Duration, Instant};

use serde_json::{Value, json};

/// Longest wait for an answer.
const PATIENCE: Duration = Duration::from_secs(60);

/// Where Debian and others put it; `CHROMIUM` names another.
fn find() -> Option<String> {
    let named = std::env::var("CHROMIUM").ok();
    let known = ["chromium", "chromium-browser", "google-chrome-stable", "google-chrome"].map(str::to_owned);
    named.into_iter().chain(known).find(|name| {
        Command::new(name)
            .arg("--version")
            .stdout(Stdio::null())
            .stderr(Stdio::null())
            .status()
            .is_ok_and(|s| s.success())
    })
}

/// One tab.
pub struct Browser {
    process: Child,
    commands: ChildStdin,
    messages: Receiver<Value>,
    count: u64,
    session: Option<String>,
    /// Texts of errors on the console, and of exceptions.
    pub errors: Vec<String>,
    /// Addresses asked for.
    pub requests: Vec<String>,
    _profile: tempfile::TempDir,
}

impl Drop for Browser {
    fn drop(&mut self) {
        let _ = self.process.kill();
        let _ = self.process.wait();
    }
}

impl Browser {
    /// Starts one, with WebGL by software or without any; `None`, and a word on stderr, where there is no browser.
    pub fn start(three_d: bool) -> Option<Self> {
        let Some(program) = find() else {
            // Not `eprintln`: the harness would keep that to itself, and a test that did not run must be seen.
            let _ = writeln!(
                std::io::stderr(),
                "\nSKIPPED: no Chromium is installed, so report.html was not opened in a browser"
            );
            return None;
        };
        let profile = tempfile::tempdir().expect("a temporary folder");
        let drawing: &[&str] = if three_d {
            &["--use-angle=swiftshader", "--enable-unsafe-swiftshader"]
        } else {
            &["--disable-gpu", "--disable-3d-apis"]
        };
        let mut process = Command::new("sh")
            // The browser reads commands from 3 and answers on 4.
            .args(["-c", "exec \"$0\" \"$@\" 3<&0 4>&1 >/dev/null 2>/dev/null", &program])
            .args([
                "--headless=new",
                "--remote-debugging-pipe",
                "--no-sandbox",
                "--no-first-run",
                "--disable-background-networking",
            ])
            .args(["--disable-component-update", "--disable-sync", "--host-resolver-rules=MAP * ~NOTFOUND"])
            .args(drawing)
            .arg(format!("--user-data-dir={}", profile.path().display()))
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .spawn()
            .expect("a shell");
        let commands = process.stdin.take().expect("piped");
        let answers = process.stdout.take().expect("piped");
        let (sender, messages) = channel();
        std::thread::spawn(move || {
            for part in BufReader::new(answers).split(0).map_while(Result::ok) {
                let message = serde_json::from_slice(&part).expect("the browser sends JSON");
                if sender.send(message).is_err() {
                    break;
                }
            }
        });
        let mut browser = Self {
            process,
            commands,
            messages,
            count: 0,
            session: None,
            errors: Vec::new(),
            requests: Vec::new(),
            _profile: profile,
        };
        let target = browser.call("Target.createTarget", json!({"url": "about:blank"}));
        let attach = json!({"targetId": target["targetId"], "flatten": true});
        browser.session = browser.call("Target.attachToTarget", attach)["sessionId"].as_str().map(str::to_owned);
        for domain in ["Page", "Runtime", "Log", "Network"] {
            browser.call(&format!("{domain}.enable"), json!({}));
        }
        Some(browser)
    }

    /// Calls a method and waits for its result.
    pub fn call(&mut self, method: &str, params: Value) -> Value {
        self.count += 1;
        let mut message = json!({"id": self.count, "method": method, "params": params});
        if let Some(session) = &self.session {
            message["sessionId"] = session.as_str().into();
        }
        let mut bytes = message.to_string().into_bytes();
        bytes.push(0);
        self.commands.write_all(&bytes).expect("the browser listens");
        let until = Instant::now() + PATIENCE;
        loop {
            let answer = self.receive(until).unwrap_or_else(|| panic!("no answer to {method}"));
            if answer["id"] == self.count {
                assert!(answer.get("error").is_none(), "{method}: {}", answer["error"]);
                return answer["result"].clone();
            }
        }
    }

    /// The next message; errors and requests are noted.
    fn receive(&mut self, until: Instant) -> Option<Value> {
        let message = match self.messages.recv_timeout(until.saturating_duration_since(Instant::now())) {
            Ok(message) => message,
            Err(RecvTimeoutError::Timeout) => return None,
            Err(RecvTimeoutError::Disconnected) => panic!("the browser went away"),
        };
        let params = &message["params"];
        match message["method"].as_str() {
            Some("Runtime.exceptionThrown") => self.errors.push(params["exceptionDetails"].to_string()),
            Some("Runtime.consoleAPICalled") if params["type"] == "error" => {
                self.errors.push(params["args"].to_string())
            }
            Some("Log.entryAdded") if params["entry"]["level"] == "error" => {
                self.errors.push(params["entry"].to_string())
            }
            Some("Network.requestWillBeSent") => {
                self.requests.extend(params["request"]["url"].as_str().map(str::to_owned));
            }
            _ => {}
        }
        Some(message)
    }

    /// Lets time pass.
    pub fn wait(&mut self, milliseconds: u64) {
        let until = Instant::now() + Duration::from_millis(milliseconds);
        while self.receive(until).is_some() {}
    }

    /// Opens a file in a window of a size, and waits until it is loaded.
    pub fn open(&mut self, file: &Path, [width, height]: [u32; 2], scheme: &str) {
        let size = json!({"width": width, "height": height, "deviceScaleFactor": 1, "mobile": width < 500});
        self.call("Emulation.setDeviceMetricsOverride", size);
        let features = json!({"features": [{"name": "prefers-color-scheme", "value": scheme}]});
        self.call("Emulation.setEmulatedMedia", features);
        let mut url = String::from("file://");
        for byte in file.display().to_string().bytes() {
            match byte {
                b'/' | b'.' | b'-' | b'_' | b'0'..=b'9' | b'A'..=b'Z' | b'a'..=b'z' => url.push(byte as char),
                _ => url += &format!("%{byte:02X}"),
            }
        }
        let opened = self.call("Page.navigate", json!({"url": url}));
        assert!(opened.get("errorText").is_none(), "{opened}");
        let until = Instant::now() + PATIENCE;
        while self.run("document.readyState") != "complete" {
            assert!(Instant::now() < until, "the page does not load");
            self.wait(20);
        }
        self.wait(300);
    }

    /// What an expression is in the page.
    pub fn run(&mut self, expression: &str) -> Value {
        let found = self.call("Runtime.evaluate", json!({"expression": expression, "returnByValue": true}));
        assert!(found.get("exceptionDetails").is_none(), "{expression}: {found}");
        found["result"]["value"].clone()
    }

    /// The whole page as PNG, base 64. The window grows and shrinks for it, so the page may draw itself anew.
    pub fn picture(&mut self) -> String {
        let size = "(() => { const e = document.documentElement; return {x: 0, y: 0, width: e.clientWidth, height: e.scrollHeight, scale: 1}; })()";
        let clip = self.run(size);
        let found = self.call("Page.captureScreenshot", json!({"clip": clip, "captureBeyondViewport": true}));
        found["data"].as_str().expect("a picture").to_owned()
    }

    /// What is drawn on the page's canvas.
    pub fn drawing(&mut self) -> String {
        self.run("document.getElementById('canvas').toDataURL()").as_str().expect("a picture").to_owned()
    }

    /// Clicks on an element at a share of its width.
    pub fn click(&mut self, selector: &str, share: f64) {
        let at = self.run(&format!(
            "(() => {{ const e = document.querySelector('{selector}'); e.scrollIntoView({{block: 'center'}}); \
             const r = e.getBoundingClientRect(); return [r.x + {share} * r.width, r.y + r.height / 2]; }})()"
        ));
        for kind in ["mousePressed", "mouseReleased"] {
            let event = json!({"type": kind, "x": at[0], "y": at[1], "button": "left", "clickCount": 1});
            self.call("Input.dispatchMouseEvent", event);
        }
        self.wait(200);
    }

    /// Presses a key on what has the focus.
    pub fn key(&mut self, name: &str, code: u32) {
        for kind in ["rawKeyDown", "keyUp"] {
            self.call(
                "Input.dispatchKeyEvent",
                json!({"type": kind, "key": name, "code": name, "windowsVirtualKeyCode": code}),
            );
        }
        self.wait(200);
    }
}
