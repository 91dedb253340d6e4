//! What reading a table of text costs: `cargo bench -p ivx-table --bench read -- FILE TARGET`.
#![expect(clippy::print_stdout, reason = "it says what it found")]

use ivx_table::{Choice, Classes, Gaps, dataset};

/// Seconds that this thread has computed for.
fn cpu() -> f64 {
    let text = std::fs::read_to_string("/proc/thread-self/schedstat").unwrap_or_default();
    text.split(' ').next().and_then(|text| text.parse::<f64>().ok()).unwrap_or_default() / 1e9
}

fn main() {
    let mut args = std::env::args().skip(1).filter(|arg| !arg.starts_with("--"));
    let (Some(path), Some(target)) = (args.next(), args.next()) else {
        println!("it is given no file and no target, and measures nothing");
        return;
    };
    let choice = Choice {
        except: Vec::new(),
        inputs: Vec::new(),
        targets: vec![target],
        one_hot: Vec::new(),
        categories: std::collections::BTreeMap::new(),
        classes: Classes::None,
        gaps: Gaps::Refused,
    };
    for _ in 0..3 {
        let begin = cpu();
        let bytes = std::fs::read(&path).expect("the file can be read");
        let data = dataset(&path, &bytes, (b',', true), &choice).expect("it is a table");
        println!("{:.2} s, {} rows", cpu() - begin, data.len());
    }
}
