//! What a run is called, and so where its results lie: after its spec's path in the project, and after what was
//! asked of it that is not asked by default.

use std::collections::BTreeMap;
use std::ffi::OsStr;
use std::fmt::Write as _;
use std::path::{Component, Path};

use ivx_cache::Digest;
use ivx_engine::Setting;
use ivx_grammar::check::{Project, Settings, check};
use ivx_grammar::ir::Spec;
use ivx_op::Registry;

use crate::history::params;

/// The profile in which every parameter has its default, where none of that name is declared.
const DEFAULTS: &str = "paper";
/// What a run writes into its folder. No folder below is called so, or it would be taken for that.
const OWN: [&str; 6] = ["results.ron", "run.ron", "report.html", "report.md", "figures", "tables"];
/// The most bytes of a part of a name; of a longer one so many are kept, and a digest.
const LONGEST: usize = 100;
const CUT: usize = 80;

/// The name of a run, which is the path of its folder below `results/`: no two specs of a project, and no two ways
/// to run one, share it, and none has a name that is one of the files and folders of another's.
///
/// - `spec`: its path in the project.
/// - `variant`: what [`variant`] says.
pub(crate) fn name(spec: &Path, variant: &str) -> String {
    let parts = spec.components().filter_map(|part| match part {
        Component::Normal(part) => Some(part),
        _ => None,
    });
    let mut parts: Vec<String> = parts.map(spelled).collect();
    let file = parts.pop().unwrap_or_default();
    // A file of another kind beside one of this name is another spec. No other name has a `%` before an `f` and an
    // `i`.
    let mut last = match file.strip_suffix(".ivx") {
        Some(stem) if !stem.is_empty() => short(stem),
        _ => short(&file) + "%file",
    };
    if !variant.is_empty() {
        last = format!("{last}@{variant}");
    }
    let mut parts: Vec<String> = parts.iter().map(|part| short(part)).collect();
    parts.push(last);
    for part in parts.iter_mut().skip(1) {
        if OWN.iter().any(|own| own.eq_ignore_ascii_case(part)) {
            part.push('%');
        }
    }
    parts.join("/")
}

/// What is asked of a run that is not asked by default: the profile, if it is another, and the parameters that have
/// another value than the profile gives them. `paper,n=50`; nothing for the run by default.
pub(crate) fn variant(
    project: &Project,
    registry: &Registry,
    settings: &Settings,
    spec: &Spec,
) -> String {
    if settings.profile.is_none() && settings.sets.is_empty() {
        return String::new();
    }
    let with = |profile: &Option<String>| {
        let plain = Settings { profile: profile.clone(), sets: Vec::new(), ..settings.clone() };
        check(project, registry, &plain).0
    };
    let usual = with(&None);
    let other = (usual.profile != spec.profile)
        .then(|| spec.profile.clone().unwrap_or_else(|| DEFAULTS.to_owned()));
    let base = if other.is_none() { usual } else { with(&settings.profile) };
    written(other.as_deref(), &differing(&params(&base), &params(spec)))
}

/// The parameters that have another value than before, by name: without the experiment where one alone is called so.
fn differing(
    before: &BTreeMap<String, Setting>,
    after: &BTreeMap<String, Setting>,
) -> Vec<(String, String)> {
    let bare = |address: &str| address.rsplit('.').next().unwrap_or(address).to_owned();
    let n_called = |name: &str| after.keys().filter(|address| bare(address) == name).count();
    let all = after.iter().map(|(address, value)| (address, exact(value)));
    let others = all
        .filter(|(address, value)| before.get(*address).map(exact).as_ref() != Some(value))
        .map(|(address, value)| {
            let name = bare(address);
            (if n_called(&name) == 1 { name } else { address.clone() }, value)
        });
    others.collect()
}

/// A value, as no other of its parameter is written.
fn exact(value: &Setting) -> String {
    match value {
        Setting::Bool(b) => b.to_string(),
        Setting::Int(n) => n.to_string(),
        Setting::Real(x) => format!("{x:?}"),
        Setting::Text(text) => text.clone(),
    }
}

/// A variant as part of a file's name. Where something in it could be read or folded to something else, a digest
/// follows.
fn written(profile: Option<&str>, settings: &[(String, String)]) -> String {
    let settings_told = settings.iter().map(|(name, value)| (name.as_str(), Some(value.as_str())));
    let told: Vec<_> =
        profile.map(|profile| (profile, None)).into_iter().chain(settings_told).collect();
    let is_plain = |c: char| c.is_ascii_lowercase() || c.is_ascii_digit() || "_.+-".contains(c);
    let is_odd = told
        .iter()
        .any(|(name, value)| !name.chars().chain(value.unwrap_or("0").chars()).all(is_plain));
    let dull = |text: &str| -> String {
        text.chars()
            .map(|c| if c.is_ascii_alphanumeric() || is_plain(c) { c } else { '-' })
            .collect()
    };
    let told = told.into_iter().map(|(name, value)| match value {
        Some(value) => format!("{}={}", dull(name), dull(value)),
        None => dull(name),
    });
    let told = told.collect::<Vec<_>>().join(",");
    if is_odd || told.len() > LONGEST {
        let exact = format!("{profile:?} {settings:?}");
        return format!("{}~{}", &told[..told.len().min(CUT)], digest(&exact));
    }
    told
}

/// A part of a path, so that every file system takes it and no other part is spelled alike. What is not plain is
/// written as `%` and the hexadecimal digits of its bytes.
fn spelled(part: &OsStr) -> String {
    let mut text = String::new();
    for chunk in part.as_encoded_bytes().utf8_chunks() {
        for c in chunk.valid().chars() {
            // Names that begin with a dot are those of files being written.
            let is_plain = c.is_alphanumeric()
                || c == ' '
                || (c.is_ascii_graphic() && !"%@~<>:\"|?*\\".contains(c));
            if is_plain && !(text.is_empty() && c == '.') {
                text.push(c);
            } else {
                hex(c.encode_utf8(&mut [0; 4]).as_bytes(), &mut text);
            }
        }
        hex(chunk.invalid(), &mut text);
    }
    text
}

fn hex(bytes: &[u8], text: &mut String) {
    for byte in bytes {
        write!(text, "%{byte:02X}").expect("strings take everything");
    }
}

/// The part, or its beginning and its digest: file systems take no longer ones.
fn short(part: &str) -> String {
    if part.len() <= LONGEST {
        return part.to_owned();
    }
    let end = (0..=CUT).rev().find(|end| part.is_char_boundary(*end)).unwrap_or_default();
    format!("{}~{}", &part[..end], digest(part))
}

fn digest(text: &str) -> String {
    Digest::of(text.as_bytes()).to_string()[..16].to_owned()
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use super::*;

    fn pairs(all: &[(&str, &str)]) -> Vec<(String, String)> {
        all.iter().map(|(name, value)| ((*name).to_owned(), (*value).to_owned())).collect()
    }

    #[test]
    fn a_folder_follows_the_path_and_what_is_asked() {
        let check = |spec: &str, variant: &str, expected: &str| {
            assert_eq!(name(Path::new(spec), variant), expected);
        };
        check("s.ivx", "", "s");
        check("x/s.ivx", "", "x/s");
        check("experiments/ch2/boxes.ivx", "paper,n=5", "experiments/ch2/boxes@paper,n=5");
        check("a/figures.ivx", "", "a/figures%");
        check("a/Tables/x.ivx", "", "a/Tables%/x");
        check("a/figures.ivx", "paper", "a/figures@paper");
        check("figures.ivx", "", "figures");
        check("s@n=5.ivx", "", "s%40n=5");
        check("s.txt", "", "s.txt%file");
        check("s", "", "s%file");
        check(".s.ivx", "", "%2Es");
        check("a b/größe.ivx", "", "a b/größe");
        check("a\n.ivx", "", "a%0A");
    }

    #[test]
    fn a_variant_is_plain_where_it_can_be() {
        let check = |profile, settings: &[(&str, &str)], expected: &str| {
            assert_eq!(written(profile, &pairs(settings)), expected);
        };
        check(None, &[], "");
        check(Some("paper"), &[], "paper");
        check(Some("paper"), &[("n", "50"), ("e.x", "-0.5")], "paper,n=50,e.x=-0.5");
        let odd = written(None, &pairs(&[("ke", "wcm(a: [1, 2])")]));
        assert!(odd.starts_with("ke=wcm-a---1--2--~") && odd.len() == 18 + 16, "{odd}");
    }

    /// Draws, by xorshift.
    struct Draw(u64);

    impl Draw {
        fn below(&mut self, n: usize) -> usize {
            self.0 ^= self.0 << 13;
            self.0 ^= self.0 >> 7;
            self.0 ^= self.0 << 17;
            usize::try_from(self.0 % 1_000_003).expect("it is small") % n
        }

        fn of<'a>(&mut self, all: &[&'a str]) -> &'a str {
            all[self.below(all.len())]
        }

        fn text(&mut self, words: &[&str]) -> String {
            (0..=self.below(3)).map(|_| self.of(words)).collect()
        }
    }

    /// A spec, a profile and settings.
    type Asked = (String, Option<String>, Vec<(String, String)>);

    #[test]
    fn other_specs_and_other_ways_to_run_them_have_other_folders_and_none_is_a_file_of_another() {
        let words = [
            "a",
            "b",
            "A",
            "figures",
            "tables",
            "results.ron",
            "run.ron",
            "report.md",
            "report.html",
            "Figures",
            "@",
            "%",
            "%25",
            "%40",
            "~",
            "=",
            ",",
            ".",
            " ",
            "é",
            "e\u{301}",
            "\n",
            "paper",
            "n=5",
            "%file",
            "/x",
            "file",
        ];
        let long = "l".repeat(120);
        let mut draw = Draw(0x9e37_79b9_7f4a_7c15);
        let mut known: BTreeMap<String, Asked> = BTreeMap::new();
        for _ in 0..60_000 {
            let mut parts: Vec<String> =
                (0..=draw.below(3)).map(|_| draw.text(&words).replace('/', "")).collect();
            if draw.below(50) == 0 {
                parts.push(format!("{long}{}", draw.of(&words).replace('/', "")));
            }
            let mut path = parts.join("/");
            path.push_str(draw.of(&[".ivx", ".ivx", ".ivx", "", ".txt", ".IVX"]));
            let plain = Path::new(&path).components().all(|c| matches!(c, Component::Normal(_)));
            if !plain || path.contains("//") || path.contains("/./") || path.ends_with("/.") {
                continue;
            }
            let profile =
                (draw.below(3) == 0).then(|| draw.of(&["paper", "few", "Few", "a_b"]).to_owned());
            let settings: Vec<(String, String)> = ["n", "e.n"][..draw.below(3)]
                .iter()
                .map(|name| {
                    (
                        (*name).to_owned(),
                        draw.text(&["5", "50", "a", "A", "/", ",", "=", "n=5", " ", &long]),
                    )
                })
                .collect();
            let folder = name(Path::new(&path), &written(profile.as_deref(), &settings));
            let asked = (path, profile, settings);
            for part in folder.split('/') {
                assert!(!part.is_empty() && !part.starts_with('.') && part.len() < 240, "{folder}");
            }
            if let Some(before) = known.insert(folder.clone(), asked.clone()) {
                assert_eq!(before, asked, "{folder}");
            }
        }
        assert!(known.len() > 20_000, "{}", known.len());
        // Where case is folded, those that differ in a variant alone do not meet either.
        let variants: BTreeSet<String> =
            ["a", "A"].map(|v| written(None, &pairs(&[("n", v)])).to_lowercase()).into();
        assert_eq!(variants.len(), 2);
        for folder in known.keys() {
            let parts: Vec<&str> = folder.split('/').collect();
            for (i, part) in parts.iter().enumerate().skip(1) {
                if known.contains_key(&parts[..i].join("/")) {
                    assert!(!OWN.iter().any(|own| own.eq_ignore_ascii_case(part)), "{folder}");
                }
            }
        }
    }
}
