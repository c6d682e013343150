//! Received frames that were not used, by cause.

use core::fmt;

use crate::codec::{DecodeError, ValueError};
use crate::e2e::Verdict;

/// Counts by cause; each saturates.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Counters {
    /// Unknown identifier.
    pub unknown_id: u16,
    /// Wrong frame format.
    pub wrong_kind: u16,
    /// Wrong length.
    pub wrong_length: u16,
    /// Wrong end-to-end CRC.
    pub crc: u16,
    /// Code or bit without meaning.
    pub malformed: u16,
    /// Non-canonical padding or encoding.
    pub not_canonical: u16,
    /// Not a finite number.
    pub not_finite: u16,
    /// Float out of its range.
    pub out_of_range: u16,
    /// Received a second time.
    pub duplicate: u16,
    /// Older than one received before.
    pub stale: u16,
    /// Missing, judged by the gap in the next counter. Not a frame dropped: not in [`Self::dropped`].
    pub lost: u16,
}

impl Counters {
    /// Counts a frame that decoding refused.
    pub const fn refuse(&mut self, error: &DecodeError) {
        let count = match error {
            DecodeError::UnknownId => &mut self.unknown_id,
            DecodeError::WrongKind => &mut self.wrong_kind,
            DecodeError::WrongLength { .. } => &mut self.wrong_length,
            DecodeError::Crc => &mut self.crc,
            DecodeError::Malformed => &mut self.malformed,
            DecodeError::NotCanonical => &mut self.not_canonical,
            DecodeError::Value(ValueError::NotFinite { .. }) => &mut self.not_finite,
            DecodeError::Value(ValueError::OutOfRange { .. }) => &mut self.out_of_range,
        };
        *count = count.saturating_add(1);
    }

    /// Counts one verdict.
    pub const fn count(&mut self, verdict: Verdict) {
        match verdict {
            Verdict::Initial | Verdict::Fresh => {}
            Verdict::Lost(frames) => self.lost = self.lost.saturating_add(frames as u16),
            Verdict::Duplicate => self.duplicate = self.duplicate.saturating_add(1),
            Verdict::Stale(_) => self.stale = self.stale.saturating_add(1),
        }
    }

    /// Frames received and dropped, whatever the cause.
    #[must_use]
    pub fn dropped(&self) -> u16 {
        [
            self.unknown_id,
            self.wrong_kind,
            self.wrong_length,
            self.crc,
            self.malformed,
            self.not_canonical,
            self.not_finite,
            self.out_of_range,
            self.duplicate,
            self.stale,
        ]
        .into_iter()
        .fold(0, u16::saturating_add)
    }
}

/// The causes that occurred: `3 with a wrong CRC, 1 stale`, or `none`; a saturated count is `>= 65535`.
impl fmt::Display for Counters {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let causes = [
            (self.unknown_id, "with an unknown identifier"),
            (self.wrong_kind, "of the wrong format"),
            (self.wrong_length, "of the wrong length"),
            (self.crc, "with a wrong CRC"),
            (self.malformed, "malformed"),
            (self.not_canonical, "not canonical"),
            (self.not_finite, "not finite"),
            (self.out_of_range, "out of range"),
            (self.duplicate, "duplicate"),
            (self.stale, "stale"),
            (self.lost, "lost"),
        ];
        let mut separator = "";
        for (count, cause) in causes.into_iter().filter(|(count, _)| *count > 0) {
            let at_least = if count == u16::MAX { ">= " } else { "" };
            write!(f, "{separator}{at_least}{count} {cause}")?;
            separator = ", ";
        }
        if separator.is_empty() {
            f.write_str("none")?;
        }
        Ok(())
    }
}
