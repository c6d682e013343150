//! `--bitrate`: the bit rates of a bus that is not ours.

use protocol::wire::BitTiming;

/// Bit rates of the recorded bus.
pub(super) fn bit_timing(text: &str) -> Result<BitTiming, String> {
    let rate = |text: &str| {
        let (digits, unit) = match text.strip_suffix(['k', 'K']) {
            Some(digits) => (digits, 1e3),
            None => text
                .strip_suffix('M')
                .map_or((text, 1.0), |digits| (digits, 1e6)),
        };
        let rate = digits.parse::<f64>().ok()? * unit;
        (rate >= 1.0 && rate <= f64::from(u32::MAX) && rate.fract() == 0.0).then_some(rate as u32)
    };
    let (nominal, data) = text.split_once(',').unwrap_or((text, text));
    match (rate(nominal), rate(data)) {
        (Some(nominal), Some(data)) => {
            BitTiming::new(nominal, data, 800).map_err(|error| error.to_string())
        }
        _ => Err(
            "allowed: bit/s, nominal and after a comma of the data phase (500k, 500k,2M)".into(),
        ),
    }
}
