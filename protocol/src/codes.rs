//! Enumerations and bit sets that are one or two bytes on the wire.
//!
//! Value, name and type are written once, so that wire, message table and text cannot disagree. A byte without meaning
//! is refused when it is read: no value of these types is ever outside its set.

use core::fmt;

/// A byte that is the code of no variant.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct UnknownCode(pub u8);

impl fmt::Display for UnknownCode {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "unknown code {}", self.0)
    }
}

impl core::error::Error for UnknownCode {}

/// Declares an enumeration of named bytes: `Variant = byte, "name";`, each under one line of documentation,
/// which is also its description at run time.
macro_rules! codes {
    (
        $(#[$meta:meta])*
        pub enum $name:ident { $(#[doc = $doc:literal] $variant:ident = $code:literal, $text:literal;)+ }
    ) => {
        $(#[$meta])*
        #[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, serde::Serialize, serde::Deserialize)]
        #[cfg_attr(feature = "defmt", derive(defmt::Format))]
        #[serde(into = "u8", try_from = "u8")]
        #[repr(u8)]
        pub enum $name { $(#[doc = $doc] $variant = $code,)+ }

        impl $name {
            /// Every variant, in the order of declaration.
            pub const ALL: &'static [Self] = &[$(Self::$variant,)+];
            /// Wire value and name of every variant.
            pub const CODES: &'static [(u8, &'static str)] = &[$(($code, $text),)+];

            /// Wire value.
            #[must_use]
            pub const fn code(self) -> u8 {
                self as u8
            }

            /// Name, lower case with hyphens.
            #[must_use]
            pub const fn name(self) -> &'static str {
                match self { $(Self::$variant => $text,)+ }
            }

            /// One sentence for a person.
            #[must_use]
            pub const fn describe(self) -> &'static str {
                match self { $(Self::$variant => $doc.trim_ascii_start(),)+ }
            }

            /// Variant of this name, or `None`.
            #[must_use]
            pub fn from_name(name: &str) -> Option<Self> {
                match name { $($text => Some(Self::$variant),)+ _ => None }
            }
        }

        impl From<$name> for u8 {
            fn from(value: $name) -> Self {
                value.code()
            }
        }

        impl TryFrom<u8> for $name {
            type Error = $crate::codes::UnknownCode;

            fn try_from(code: u8) -> Result<Self, Self::Error> {
                match code { $($code => Ok(Self::$variant),)+ _ => Err($crate::codes::UnknownCode(code)) }
            }
        }

        impl core::fmt::Display for $name {
            fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
                f.write_str(self.name())
            }
        }
    };
}

/// Declares a set of named bits, numbered from bit 0 without gaps: `FLAG, "name";`. The bits above are reserved: sent
/// as zero, refused when set.
macro_rules! bits {
    (
        $(#[$meta:meta])*
        pub struct $name:ident: $raw:ident { $($(#[$doc:meta])* $flag:ident = $bit:literal, $text:literal;)+ }
    ) => {
        $(#[$meta])*
        #[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
        #[cfg_attr(feature = "defmt", derive(defmt::Format))]
        pub struct $name($raw);

        impl $name {
            $($(#[$doc])* pub const $flag: Self = Self(1 << $bit);)+

            /// No bit set.
            pub const EMPTY: Self = Self(0);
            /// Names of the bits, from bit 0 on.
            pub const NAMES: &'static [&'static str] = &[$($text,)+];
            /// Every bit that has a meaning.
            const DEFINED: $raw = 0 $(| 1 << $bit)+;

            /// Wire value.
            #[must_use]
            pub const fn bits(self) -> $raw {
                self.0
            }

            /// Set of this wire value, or `None` if a reserved bit is set.
            #[must_use]
            pub const fn from_bits(bits: $raw) -> Option<Self> {
                if bits & Self::DEFINED == bits { Some(Self(bits)) } else { None }
            }

            /// Whether all bits of `other` are set.
            #[must_use]
            pub const fn contains(self, other: Self) -> bool {
                self.0 & other.0 == other.0
            }

            /// This set with the bits of `other` set or cleared.
            #[must_use]
            pub const fn with(self, other: Self, on: bool) -> Self {
                if on { Self(self.0 | other.0) } else { Self(self.0 & !other.0) }
            }
        }

        impl core::ops::BitOr for $name {
            type Output = Self;

            fn bitor(self, other: Self) -> Self {
                Self(self.0 | other.0)
            }
        }

        impl serde::Serialize for $name {
            fn serialize<S: serde::Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
                self.0.to_le_bytes().serialize(serializer)
            }
        }

        impl<'de> serde::Deserialize<'de> for $name {
            fn deserialize<D: serde::Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
                let bytes = <[u8; size_of::<$raw>()]>::deserialize(deserializer)?;
                Self::from_bits($raw::from_le_bytes(bytes))
                    .ok_or_else(|| serde::de::Error::custom("reserved bit set"))
            }
        }
    };
}

pub(crate) use {bits, codes};
