//! The page in a browser: pictures load, nothing is too wide, tables sort, nothing is asked of the network.

use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

use monolayer::report::page;
use monolayer::results::Results;
use serde_json::Value;

use crate::common::results;
use crate::skipped::skip;

const BROWSERS: [&str; 4] = ["chromium", "chromium-browser", "google-chrome", "google-chrome-stable"];

/// Listens before anything is loaded.
const BEFORE: &str = r#"<script>
window.seen = [];
addEventListener("error", e => seen.push("error: " + (e.message || e.target.outerHTML.slice(0, 80))), true);
addEventListener("unhandledrejection", e => seen.push("rejection: " + e.reason));
document.addEventListener("securitypolicyviolation", e => seen.push("forbidden: " + e.blockedURI));
for (const level of ["error", "warn"]) console[level] = (...texts) => seen.push(level + ": " + texts.join(" "));
</script>"#;

/// Looks when all is loaded, and writes what it found into the page.
const AFTER: &str = r##"<script>
addEventListener("load", () => {
  const numbers = (table, at) => [...table.tBodies[0].rows].map(row => row.cells[at].dataset.value ?? "");
  const tables = [...document.querySelectorAll("table.sortable")];
  const sorted = tables.slice(0, 1).map(table => {
    const heads = [...table.tHead.rows[0].cells];
    const at = heads.findIndex(head => head.textContent.startsWith("free energy"));
    const before = numbers(table, at);
    const button = heads[at].querySelector("button");
    button.click();
    const up = [numbers(table, at), heads[at].getAttribute("aria-sort")];
    button.click();
    return { before, up: up[0], said: up[1], down: numbers(table, at) };
  });
  document.querySelectorAll("details").forEach(details => { details.open = true; });
  const inner = e => e.closest(".scroll") && !e.classList.contains("scroll");
  const wide = [...document.body.querySelectorAll("*")]
    .filter(e => !inner(e) && e.getBoundingClientRect().right > innerWidth + 0.5)
    .map(e => e.outerHTML.slice(0, 120));
  const images = [...document.images];
  const found = {
    title: document.title,
    width: innerWidth,
    page: document.documentElement.scrollWidth,
    wide,
    images: images.length,
    loaded: images.filter(image => image.complete && image.naturalWidth > 0).length,
    rows: tables.map(table => table.tBodies[0].rows.length),
    buttons: document.querySelectorAll("th button").length,
    requests: performance.getEntriesByType("resource").map(r => r.name.slice(0, 60))
      .filter(n => !n.startsWith("data:")),
    sorted,
    seen,
  };
  const out = document.createElement("pre");
  out.id = "found";
  out.textContent = btoa(unescape(encodeURIComponent(JSON.stringify(found))));
  document.body.append(out);
});
</script>"##;

fn runs(name: &str) -> bool {
    let status = Command::new(name).arg("--version").stdout(Stdio::null()).stderr(Stdio::null()).status();
    status.is_ok_and(|status| status.success())
}

const NO_BROWSER: &str = "there is no Chromium, and it cannot be installed";

/// A browser of the machine; the system's package of one where it can be installed.
fn browser() -> Option<&'static str> {
    let find = || BROWSERS.into_iter().find(|name| runs(name));
    if let Some(found) = find() {
        return Some(found);
    }
    let is_root = Command::new("id").arg("-u").output().is_ok_and(|out| out.stdout.trim_ascii() == b"0");
    let apt = |arguments: &[&str]| {
        let mut command = Command::new("apt-get");
        command.env("DEBIAN_FRONTEND", "noninteractive").args(arguments).stdout(Stdio::null()).stderr(Stdio::null());
        command.status().is_ok_and(|status| status.success())
    };
    if is_root && apt(&["update", "-qq"]) {
        apt(&["install", "-y", "-qq", "--no-install-recommends", "chromium"]);
    }
    find()
}

/// Runs the browser, but not for ever.
fn run_browser(browser: &str, arguments: &[String]) -> String {
    let mut command = Command::new(browser);
    command.args(["--headless", "--no-sandbox", "--disable-gpu", "--disable-dev-shm-usage", "--hide-scrollbars"]);
    let mut child = command.args(arguments).stdout(Stdio::piped()).stderr(Stdio::null()).spawn().unwrap();
    let mut pipe = child.stdout.take().unwrap();
    let reader = std::thread::spawn(move || {
        let mut text = String::new();
        std::io::Read::read_to_string(&mut pipe, &mut text).map(|_| text)
    });
    let begin = Instant::now();
    while child.try_wait().unwrap().is_none() {
        if begin.elapsed() > Duration::from_secs(120) {
            child.kill().unwrap();
            panic!("the browser did not end: {arguments:?}");
        }
        std::thread::sleep(Duration::from_millis(50));
    }
    reader.join().unwrap().unwrap()
}

fn look(browser: &str, folder: &Path, file: &Path, width: u32) -> Value {
    let profile = folder.join(format!("profile-{width}"));
    let dom = run_browser(
        browser,
        &[
            format!("--user-data-dir={}", profile.display()),
            format!("--window-size={width},1000"),
            "--virtual-time-budget=20000".to_owned(),
            "--dump-dom".to_owned(),
            format!("file://{}", file.display()),
        ],
    );
    let found = dom.split("<pre id=\"found\">").nth(1).and_then(|rest| rest.split('<').next());
    let found = found.unwrap_or_else(|| panic!("the check did not run: {}", &dom[..dom.len().min(2000)]));
    use base64::Engine;
    let bytes = base64::engine::general_purpose::STANDARD.decode(found).unwrap();
    serde_json::from_slice(&bytes).unwrap()
}

fn with_check(folder: &Path, html: &str) -> PathBuf {
    let file = folder.join("page.html");
    let html =
        html.replacen("<head>", &format!("<head>{BEFORE}"), 1).replacen("</body>", &format!("{AFTER}</body>"), 1);
    std::fs::write(&file, html).unwrap();
    file
}

fn numbers(value: &Value) -> Vec<f64> {
    value.as_array().unwrap().iter().filter_map(|v| v.as_str()?.parse().ok()).collect()
}

#[test]
fn the_page_works_in_a_browser() {
    let Some(browser) = browser() else {
        skip("the_page_works_in_a_browser", NO_BROWSER);
        return;
    };
    let folders = ["one", "two", "sweep", "orders"].map(|name| Results::read(&results().join(name)).unwrap());
    let html = page(&folders);
    let temporary = tempfile::tempdir().unwrap();
    let file = with_check(temporary.path(), &html);
    let table = std::fs::read_to_string(results().join("sweep/results.csv")).unwrap();
    for width in [1280, 700] {
        let found = look(browser, temporary.path(), &file, width);
        assert_eq!(found["width"], width, "{found}");
        assert_eq!(found["seen"], serde_json::json!([]), "errors");
        assert_eq!(found["requests"], serde_json::json!([]), "requests");
        assert_eq!(found["title"], "4 results", "nothing in a title runs");
        assert_eq!(found["wide"], serde_json::json!([]), "at {width}");
        assert!(found["page"].as_u64().unwrap() <= u64::from(width), "{found}");
        assert_eq!(found["images"], html.matches("<img").count());
        assert_eq!(found["images"], found["loaded"]);
        let rows: Vec<u64> = found["rows"].as_array().unwrap().iter().filter_map(Value::as_u64).collect();
        assert_eq!(rows[..3], [2, table.lines().count() as u64 - 1, table.lines().count() as u64 - 1]);
        assert!(found["buttons"].as_u64().unwrap() > 10);
        let sorted = &found["sorted"][0];
        let [before, up, down] = ["before", "up", "down"].map(|key| numbers(&sorted[key]));
        assert_eq!(before.len(), 2);
        assert_eq!(sorted["said"], "ascending");
        assert!(up[0] < up[1] && down[0] > down[1], "{sorted}");
    }
}

#[test]
fn the_check_sees_what_is_wrong() {
    let Some(browser) = browser() else {
        skip("the_check_sees_what_is_wrong", NO_BROWSER);
        return;
    };
    let html = "<!DOCTYPE html><html><head><title>x</title></head><body><img src=\"data:image/png;base64,AAAA\">\
                <div style=\"width: 3000px\">wide</div><script>throw new Error(\"thrown\")</script></body></html>";
    let temporary = tempfile::tempdir().unwrap();
    let found = look(browser, temporary.path(), &with_check(temporary.path(), html), 700);
    assert!(found["seen"].to_string().contains("thrown"), "{found}");
    assert_eq!((found["images"].as_u64(), found["loaded"].as_u64()), (Some(1), Some(0)));
    assert!(found["wide"].to_string().contains("3000px"), "{found}");
}
