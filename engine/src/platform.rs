//! Where bit-equality is a promise.

/// The target and the processor features that kernels choose by.
#[must_use]
pub fn platform() -> String {
    let target = format!("{}-{}", std::env::consts::ARCH, std::env::consts::OS);
    features().iter().fold(target, |platform, feature| platform + "+" + feature)
}

#[cfg(target_arch = "x86_64")]
fn features() -> Vec<&'static str> {
    use std::arch::is_x86_feature_detected as has;
    let known = [("avx2", has!("avx2")), ("fma", has!("fma")), ("avx512f", has!("avx512f"))];
    known.iter().filter(|(_, present)| *present).map(|(name, _)| *name).collect()
}

#[cfg(not(target_arch = "x86_64"))]
fn features() -> Vec<&'static str> {
    Vec::new()
}
