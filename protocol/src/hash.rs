//! Hash of the message table: two nodes compare it to check that they use the same protocol.

use crate::e2e::Profile;
use crate::messages::Node;
use crate::schema::{Kind, MessageInfo, Rate, Signal};

/// FNV-1a, 32 bits, of message descriptions. Whatever does not change the meaning of bytes (documentation,
/// Rust types) is left out.
#[must_use]
pub const fn schema(mut messages: &[&MessageInfo]) -> u32 {
    let mut hash = Fnv1a::new();
    while let [info, rest @ ..] = messages {
        hash = hash.message(info);
        messages = rest;
    }
    hash.0
}

/// FNV-1a (Fowler, Noll, Vo). Texts end with 0xFF, which UTF-8 does not contain, and lists with 0xFE, so that no two
/// tables give the same bytes.
struct Fnv1a(u32);

impl Fnv1a {
    const fn new() -> Self {
        Self(0x811C_9DC5)
    }

    const fn bytes(mut self, mut bytes: &[u8]) -> Self {
        while let [byte, rest @ ..] = bytes {
            self.0 = (self.0 ^ *byte as u32).wrapping_mul(0x0100_0193);
            bytes = rest;
        }
        self
    }

    const fn number(self, number: usize) -> Self {
        self.bytes(&(number as u32).to_le_bytes())
    }

    const fn text(self, text: &str) -> Self {
        self.bytes(text.as_bytes()).bytes(&[0xFF])
    }

    const fn message(self, info: &MessageInfo) -> Self {
        let rate = match info.rate {
            Rate::EverySample => [1, 0],
            Rate::Hertz(hertz) => [2, hertz],
            Rate::Event => [3, 0],
        };
        let protection = match info.protection {
            None => 0,
            Some(Profile::Classical) => 1,
            Some(Profile::Fd) => 2,
        };
        let mut hash = self
            .text(info.name)
            .number(info.id as usize)
            .node(info.sender)
            .node(info.receiver)
            .bytes(&rate)
            .number(info.len)
            .number(protection);
        let mut signals = info.signals;
        while let [signal, rest @ ..] = signals {
            hash = hash.signal(signal);
            signals = rest;
        }
        hash.bytes(&[0xFE])
    }

    const fn node(self, node: Option<Node>) -> Self {
        self.bytes(&[match node {
            Some(node) => node.code(),
            None => 0,
        }])
    }

    const fn signal(self, signal: &Signal) -> Self {
        let mut hash = self.text(signal.name).number(signal.offset);
        hash = match signal.when {
            Some(tag) => hash.bytes(&[1, tag]),
            None => hash.bytes(&[0]),
        };
        let mut elements = signal.elements;
        while let [(name, unit), rest @ ..] = elements {
            hash = hash.text(name).text(unit);
            elements = rest;
        }
        hash.bytes(&[0xFE]).kind(signal.kind)
    }

    const fn kind(self, kind: Kind) -> Self {
        match kind {
            Kind::U8 => self.text("u8"),
            Kind::U16 => self.text("u16"),
            Kind::U32 => self.text("u32"),
            Kind::I16 => self.text("i16"),
            Kind::I32 => self.text("i32"),
            Kind::F32 { min, max } => self
                .text("f32")
                .number(min.to_bits() as usize)
                .number(max.to_bits() as usize),
            Kind::Code(codes) => self.text("code").codes(codes),
            Kind::Selector(codes) => self.text("selector").codes(codes),
            Kind::Flags8(names) => self.text("flags8").names(names),
            Kind::Flags16(names) => self.text("flags16").names(names),
        }
    }

    const fn codes(self, mut codes: &[(u8, &str)]) -> Self {
        let mut hash = self;
        while let [(code, name), rest @ ..] = codes {
            hash = hash.bytes(&[*code]).text(name);
            codes = rest;
        }
        hash.bytes(&[0xFE])
    }

    const fn names(self, mut names: &[&str]) -> Self {
        let mut hash = self;
        while let [name, rest @ ..] = names {
            hash = hash.text(name);
            names = rest;
        }
        hash.bytes(&[0xFE])
    }
}

#[cfg(test)]
mod tests {
    use super::Fnv1a;

    /// Test vectors of the algorithm's authors.
    #[test]
    fn fnv1a_is_the_published_one() {
        for (text, hash) in [
            ("", 0x811C_9DC5),
            ("a", 0xE40C_292C),
            ("foobar", 0xBF9C_F968),
        ] {
            assert_eq!(Fnv1a::new().bytes(text.as_bytes()).0, hash);
        }
    }
}
