//! The report as a browser shows it.
//!
//! Needs a browser of Chromium's family: that of the variable `BROWSER`, or the first found.

mod common;

use std::ffi::OsString;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

/// Words of a spec are anybody's: these try to act.
const SPEC: &str = r#"edition "2026"

/// Of **two** things <script>document.title = "acted"</script>, <b>not bold</b>, [a link](javascript:alert(1))
/// and ![a picture](http://example.invalid/seen.png).
experiment shown {
    param level: Float = 1.0   /// <img src=x onerror="document.title='acted'">
    axis seed = 0..5
    axis ke = { "</script><script>document.title = 'acted'</script>": wcm(), "MA": ma() }
    let reward = sinusoids()
    let data = sample(reward, n: 5)
    let model = train(ensemble(map_estimate(net: mlp(hidden: [4])), members: 2), on: data, steps: 2)
    let decision = argmax(model, ke: ke, among: grid(-1.0, 1.0, points: 3))
    measure gap = regret(decision, under: reward)
    figure "1" = bars(gap, by: ke, y_label: "</text><script>document.title = 'acted'</script>")
    table "2" = table(gap, rows: ke, digits: 2)
    claim "the level is <i>low</i>" : level < 2.0
    claim "the level is high" : level > 2.0
}
"#;

fn browser() -> Option<OsString> {
    let named = std::env::var_os("BROWSER");
    let usual = ["chromium", "chromium-browser", "google-chrome"].map(OsString::from);
    named.into_iter().chain(usual).find(|name| {
        Command::new(name).arg("--version").output().is_ok_and(|said| said.status.success())
    })
}

/// A project with the report of `SPEC`, and where that is.
fn written() -> (tempfile::TempDir, PathBuf) {
    let folder = common::project(&[("shown.ivx", SPEC)]);
    let said = common::ivx(folder.path(), &["exec", "shown.ivx"]).output().expect("it runs");
    let out = String::from_utf8_lossy(&said.stdout).into_owned();
    assert!(out.contains("report:  results/shown/report.html"), "{out}");
    assert!(said.status.success());
    let report = folder.path().join("results/shown/report.html");
    (folder, report)
}

#[test]
fn the_report_holds_everything_and_nothing_that_acts() {
    let (_folder, report) = written();
    let page = fs::read_to_string(report).expect("it is written");
    for hostile in ["<script", "<img", "<iframe", "<link", "url(", "href=\"http", "href=\"java"] {
        assert!(!page.contains(hostile), "{hostile}");
    }
    for shown in [
        "<b>1</b>",
        "✓</span> holds",
        "✗</span> fails",
        "the level is &lt;i&gt;low&lt;/i&gt;",
        "<strong>two</strong>",
        "Figure 1",
        "Table 2",
        "ivx exec shown.ivx",
        "results.ron",
    ] {
        assert!(page.contains(shown), "{shown} in {page}");
    }
    // Who follows a link within the page arrives.
    for link in page.split("href=\"#").skip(1) {
        let id = link.split('"').next().expect("a split has a first part");
        assert!(id.is_empty() || page.contains(&format!("id=\"{id}\"")), "{id}");
    }
}

#[test]
fn claims_are_grouped_where_there_are_several_experiments() {
    let one = |name: &str| {
        format!("experiment {name} {{ param low: Float = 1.0 claim \"low\" : low < 2.0 }}\n")
    };
    let alone = format!("edition \"2026\"\n{}", one("a"));
    let both = format!("{alone}{}", one("b"));
    for (spec, n_groups) in [(alone, 0), (both, 2)] {
        let folder = common::project(&[("spec.ivx", &spec)]);
        let said = common::ivx(folder.path(), &["exec", "spec.ivx"]).output().expect("it runs");
        assert!(said.status.success(), "{}", String::from_utf8_lossy(&said.stderr));
        let page = fs::read_to_string(folder.path().join("results/spec/report.html"));
        let page = page.expect("it is written");
        assert_eq!(page.matches("scope=\"rowgroup\"").count(), n_groups);
        assert_eq!(page.matches("<li><a href=\"#e").count(), n_groups);
    }
}

#[test]
fn a_browser_shows_the_report_in_light_and_dark_and_prints_it() {
    let Some(browser) = browser() else {
        eprintln!("skipped: there is no Chromium to look at the report with (set BROWSER)");
        return;
    };
    let (folder, report) = written();
    let folder = folder.path();
    let page = format!("file://{}", report.display());
    let look = |args: &[&str]| -> Output {
        let mut look = Command::new(&browser);
        look.args(["--headless=new", "--no-sandbox", "--disable-gpu", "--hide-scrollbars"]);
        look.args([
            "--disable-dev-shm-usage",
            "--enable-logging=stderr",
            "--user-data-dir=profile",
        ]);
        let seen = look.args(args).arg(&page).current_dir(folder).output().expect("it runs");
        let said = String::from_utf8_lossy(&seen.stderr);
        assert!(seen.status.success(), "{said}");
        // Whatever a page complains of, and whatever its policy forbade, is told there.
        assert!(!said.contains("CONSOLE"), "{said}");
        seen
    };
    let read = |name: &str| fs::read(folder.join(name)).expect("the browser has written it");

    let dom = String::from_utf8(look(&["--dump-dom"]).stdout).expect("it is text");
    assert!(dom.contains("<title>shown</title>") && dom.contains("</body></html>"), "{dom}");
    assert_eq!(dom.matches("<h2>").count(), 3, "claims, the experiment, how to do it again");
    assert_eq!(dom.matches("<figure").count(), 2);

    look(&["--print-to-pdf=report.pdf", "--no-pdf-header-footer"]);
    assert!(read("report.pdf").starts_with(b"%PDF"));

    let size = "--window-size=1000,2000";
    look(&["--screenshot=light.png", size, "--blink-settings=preferredColorScheme=1"]);
    look(&["--screenshot=dark.png", size, "--blink-settings=preferredColorScheme=0"]);
    let (light, dark) = (read("light.png"), read("dark.png"));
    assert!(light.starts_with(b"\x89PNG") && light != dark, "it has a dark look of its own");
}

/// `BLESS=1` takes the picture anew; look at it.
#[test]
fn the_readme_begins_with_the_report_of_its_spec() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
    let readme = fs::read_to_string(root.join("README.md")).expect("it is there");
    let block = |fence: &str| {
        let (_, rest) = readme.split_once(fence).expect("there is such a block");
        rest.split_once("```").expect("a block ends").0
    };
    let name = "overoptimisation.ivx";
    assert!(readme.contains(&format!("```sh\nivx exec {name}\n```")));
    let folder = common::project(&[(name, block("```ivx\n"))]);
    let folder = folder.path();
    let said = common::ivx(folder, &["exec", name]).output().expect("it runs");
    let (told, shown) = (String::from_utf8_lossy(&said.stdout), block("```text\n"));
    assert!(told.starts_with(shown), "README.md shows\n{shown}but there came\n{told}");

    let Some(browser) = browser() else {
        eprintln!("skipped: there is no Chromium to take the report's picture with (set BROWSER)");
        return;
    };
    let mut look = Command::new(browser);
    look.args(["--headless=new", "--no-sandbox", "--disable-gpu", "--hide-scrollbars"]);
    look.args(["--disable-dev-shm-usage", "--user-data-dir=profile", "--screenshot=report.png"]);
    look.args(["--force-device-scale-factor=1.2", "--blink-settings=preferredColorScheme=1"]);
    // As high as claims and figures are.
    look.arg("--window-size=1080,1010");
    look.arg(folder.join("results/overoptimisation/report.html")).current_dir(folder);
    assert!(look.output().expect("it runs").status.success());
    let taken = fs::read(folder.join("report.png")).expect("the browser has written it");
    let picture = root.join("docs/pictures/report.png");
    if std::env::var_os("BLESS").is_some() {
        fs::write(&picture, &taken).expect("pictures can be written");
    }
    let kept = fs::read(&picture).expect("the picture is there");
    // How long the run took is on it: what is the same is that it is a picture, and how large.
    let head = 24;
    assert_eq!(
        taken[..head],
        kept[..head],
        "docs/pictures/report.png is stale: run this test with BLESS=1"
    );
    assert!(taken.len() > 50_000 && kept.len() > 50_000, "something is on it");
}
