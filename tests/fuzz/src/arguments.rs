//! What a person types behind an option: buses, laws, identifiers and times of a trace.

use link::LinkAddress;
use protocol::table::TABLE;
use sim::selection::LawChoice;
use trace::select::{Ids, Moment};

/// What is accepted is what was typed; what is refused is answered with what is allowed.
pub(crate) fn arguments(bytes: &[u8]) {
    let Ok(text) = std::str::from_utf8(bytes) else {
        return;
    };
    match text.parse::<LinkAddress>() {
        Ok(address) => assert_eq!(address.to_string(), text),
        Err(error) => assert!(error.to_string().contains("allowed")),
    }
    match text.parse::<LawChoice>() {
        Ok(law) => assert_eq!(law.to_string().parse(), Ok(law)),
        Err(error) => assert!(!error.to_string().is_empty()),
    }
    if text.parse::<Ids>().is_ok() {
        let is_name = |text: &str| {
            TABLE
                .iter()
                .any(|info| info.name.eq_ignore_ascii_case(text))
        };
        let is_number = |text: &str| {
            let digits = text.strip_prefix("0x").unwrap_or(text);
            !digits.is_empty() && digits.bytes().all(|byte| byte.is_ascii_hexdigit())
        };
        assert!(
            is_name(text) || text.split('-').all(is_number),
            "{text:?} was accepted as identifiers"
        );
    }
    match text.parse::<Moment>() {
        Ok(_) => {
            let seconds = text.strip_prefix('+').unwrap_or(text);
            assert!(
                seconds.bytes().all(|b| b.is_ascii_digit() || b == b'.'),
                "{text:?} was accepted as a time"
            );
        }
        Err(error) => assert!(error.contains("allowed")),
    }
}
