//! Text of numbers and frames, appended to a line. By hand, or by crates that do nothing else: `core::fmt` would cost several
//! times as much as the rest of a reader or writer.

use std::fmt;

/// The hexadecimal digits of a byte.
const PAIRS: [[u8; 2]; 256] = {
    let digits = b"0123456789ABCDEF";
    let mut pairs = [[0; 2]; 256];
    let mut byte = 0;
    while byte < 256 {
        pairs[byte] = [digits[byte >> 4], digits[byte & 0xF]];
        byte += 1;
    }
    pairs
};

/// A line under construction. Its room is used again for the next.
#[derive(Debug, Default)]
pub(crate) struct Line(Vec<u8>);

impl Line {
    pub(crate) fn clear(&mut self) {
        self.0.clear();
    }

    pub(crate) fn bytes(&self) -> &[u8] {
        &self.0
    }

    pub(crate) fn byte(&mut self, byte: u8) {
        self.0.push(byte);
    }

    pub(crate) fn extend(&mut self, bytes: &[u8]) {
        self.0.extend_from_slice(bytes);
    }

    pub(crate) fn word(&mut self, word: &str) {
        self.extend(word.as_bytes());
    }

    pub(crate) fn blanks(&mut self, count: usize) {
        self.0.resize(self.0.len() + count, b' ');
    }

    pub(crate) fn integer(&mut self, value: impl itoa::Integer) {
        self.word(itoa::Buffer::new().format(value));
    }

    /// An integer behind as many of `fill` as make it `width` long.
    pub(crate) fn padded(&mut self, value: impl itoa::Integer, width: usize, fill: u8) {
        let mut digits = itoa::Buffer::new();
        let digits = digits.format(value);
        let missing = width.saturating_sub(digits.len());
        self.0.resize(self.0.len() + missing, fill);
        self.word(digits);
    }

    /// As few digits as distinguish the number from every other, and no exponent, like `Display`.
    pub(crate) fn float(&mut self, value: f32) {
        if value == 0.0 {
            return self.word(if value.is_sign_negative() { "-0" } else { "0" });
        }
        // Beyond, the other crate writes an exponent.
        if !(1e-6..1e13).contains(&value.abs()) {
            return self.display(value);
        }
        let mut digits = zmij::Buffer::new();
        let digits = digits.format_finite(value).as_bytes();
        let point = digits.iter().position(|&digit| digit == b'.');
        let decimals = digits.len() - point.map_or(digits.len(), |point| point + 1);
        if let [whole @ .., b'.', b'0'] = digits {
            self.extend(whole);
        } else if decimals_of(value) == decimals + 1 {
            // In the middle between two candidates, `Display` takes the one farther from zero, and the other crate the even one.
            self.display(value);
        } else {
            self.extend(digits);
        }
    }

    /// Seconds with all microseconds.
    pub(crate) fn seconds(&mut self, time_us: u64) {
        self.integer(time_us / 1_000_000);
        self.byte(b'.');
        self.padded(time_us % 1_000_000, 6, b'0');
    }

    /// The low `digits` hexadecimal digits.
    pub(crate) fn hex(&mut self, value: u32, digits: u32) {
        for digit in (0..digits).rev() {
            let [_, low] = PAIRS[(value >> (4 * digit) & 0xF) as usize];
            self.byte(low);
        }
    }

    /// Bytes in hexadecimal, without blanks.
    pub(crate) fn data(&mut self, bytes: &[u8]) {
        let from = self.0.len();
        self.0.resize(from + 2 * bytes.len(), 0);
        let (pairs, _) = self.0[from..].as_chunks_mut::<2>();
        for (pair, &byte) in pairs.iter_mut().zip(bytes) {
            *pair = PAIRS[usize::from(byte)];
        }
    }

    /// Bytes in hexadecimal, each behind a blank.
    pub(crate) fn spaced(&mut self, bytes: &[u8]) {
        let from = self.0.len();
        self.0.resize(from + 3 * bytes.len(), 0);
        let (triples, _) = self.0[from..].as_chunks_mut::<3>();
        for (triple, &byte) in triples.iter_mut().zip(bytes) {
            let [high, low] = PAIRS[usize::from(byte)];
            *triple = [b' ', high, low];
        }
    }

    /// Whatever is written seldom.
    pub(crate) fn display(&mut self, value: impl fmt::Display) {
        // Writing to a vector cannot fail.
        let _ = std::io::Write::write_fmt(&mut self.0, format_args!("{value}"));
    }
}

/// How many decimals the exact value has: as many as it has binary places.
fn decimals_of(value: f32) -> usize {
    let (exponent, fraction) = (value.to_bits() >> 23 & 0xFF, value.to_bits() & 0x7F_FFFF);
    let zeros = (fraction | 1 << 23).trailing_zeros();
    150_u32.saturating_sub(exponent.max(1) + zeros) as usize
}

#[cfg(test)]
mod tests {
    use super::Line;

    /// Floats over all exponents and both signs, those where the notation changes, and those in the middle between two candidates.
    #[test]
    fn floats_are_those_of_display() {
        let steps = (0..=u32::MAX).step_by(9973).map(f32::from_bits);
        let edges = [0.0, -0.0, 1e-5, 9.999_999e-6, 1e7, 1e16, 1e17, f32::MAX];
        let dyadic = (0..24).flat_map(|shift| {
            (0..1 << 24)
                .step_by(7919)
                .map(move |odd| (odd as f32 + 1.0) / (1_u32 << shift) as f32)
        });
        let mut line = Line::default();
        for value in steps.chain(edges).chain(dyadic) {
            line.clear();
            line.float(value);
            assert_eq!(String::from_utf8_lossy(line.bytes()), value.to_string());
        }
    }
}
