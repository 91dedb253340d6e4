//! Which `ivx` this is.

use std::sync::LazyLock;

use ivx_library::SOURCE_DIGEST;

/// `0.1.0 (library 3f2a91bc, procgen)`: the version, the digest of the library's source that records of results have
/// in full, and what was built in beside the usual.
pub(crate) fn version() -> &'static str {
    static VERSION: LazyLock<String> = LazyLock::new(|| {
        let built_in =
            [("procgen", cfg!(feature = "procgen")), ("parquet", cfg!(feature = "parquet"))];
        told(SOURCE_DIGEST, built_in.into_iter().filter(|(_, is_in)| *is_in).map(|(name, _)| name))
    });
    &VERSION
}

fn told<'a>(library: &'a str, features: impl Iterator<Item = &'a str>) -> String {
    let parts: Vec<&str> = [&library[..8]].into_iter().chain(features).collect();
    format!("{} (library {})", env!("CARGO_PKG_VERSION"), parts.join(", "))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_version_names_the_library_and_what_is_built_in() {
        let digest = "3f2a91bc".repeat(8);
        let number = env!("CARGO_PKG_VERSION");
        assert_eq!(told(&digest, [].into_iter()), format!("{number} (library 3f2a91bc)"));
        let all = told(&digest, ["procgen", "parquet"].into_iter());
        assert_eq!(all, format!("{number} (library 3f2a91bc, procgen, parquet)"));
        assert!(version().contains(&SOURCE_DIGEST[..8]));
    }
}
