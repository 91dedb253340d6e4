//! Every text that the fuzzer found something new in, through the stages that it goes through.

use std::fs;
use std::path::Path;

use crate::pipeline;

#[test]
fn every_text_of_the_corpus_obeys_the_laws() {
    let registry = ivx_library::registry();
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../fuzz/corpus");
    let mut files = fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path());
    let texts = files.by_ref().map(|path| fs::read(path).unwrap());
    let n = texts.map(|bytes| pipeline::run(&String::from_utf8_lossy(&bytes), &registry)).count();
    assert!(n > 100, "{n} texts are found");
}
