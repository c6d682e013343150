//! How often a property draws.

use proptest::prelude::ProptestConfig;

/// What proptest draws without being told.
const DEFAULT: u64 = 256;

/// `usual` draws, and as many times that as `PROPTEST_CASES` is times the default: a property that states its number otherwise keeps to it
/// when a night asks for more.
pub(crate) fn cases(usual: u32) -> ProptestConfig {
    let config = ProptestConfig::default();
    let cases = u64::from(usual) * u64::from(config.cases) / DEFAULT;
    ProptestConfig {
        cases: cases.clamp(1, u64::from(u32::MAX)) as u32,
        ..config
    }
}
