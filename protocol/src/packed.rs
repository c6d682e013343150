//! The two messages of every sample, packed by hand: field after field, little-endian, without padding.
//!
//! The codec runs both once per sample and skips checks that cannot fail: every bit belongs to a field and every field
//! is taken as it is, so two different bodies never read as the same message, and there is no need to write a message
//! again to see that it has no other form. The floats are four of one kind, checked against one limit.

use crate::messages::{Command, ControlWord, DriveStatus, Feedback};
use crate::schema::{Kind, MessageInfo};
use crate::table;

/// A message of a fixed number of bytes.
pub(crate) trait Packed<const LEN: usize>: Sized {
    /// The message in these bytes, or `None` if a field has no such value.
    fn unpack(body: &[u8; LEN]) -> Option<Self>;

    /// Fills the bytes; `None` if there are fewer than the fields take, which the tests of the layout rule out.
    fn pack(&self, body: &mut [u8; LEN]) -> Option<()>;

    /// Whether all floats in these bytes are finite and in the range that the table gives them.
    fn in_range(body: &[u8; LEN]) -> bool;
}

const FEEDBACK_LEN: usize = 45;
const COMMAND_LEN: usize = 21;

// No padding: the fields fill the body.
const _: () = assert!(FEEDBACK_LEN == table::FEEDBACK.body_len());
const _: () = assert!(COMMAND_LEN == table::COMMAND.body_len());

const VELOCITY: Floats = Floats::of(&table::FEEDBACK);
const TORQUE: Floats = Floats::of(&table::COMMAND);

/// The only float signal of a message, of symmetric range.
struct Floats {
    /// First byte.
    at: usize,
    /// Greatest magnitude.
    max: f32,
}

impl Floats {
    const fn of(info: &MessageInfo) -> Self {
        let (mut found, mut floats) = (0, Self { at: 0, max: 0.0 });
        let mut signals = info.signals;
        while let [signal, rest @ ..] = signals {
            if let Kind::F32 { min, max } = signal.kind {
                assert!(min == -max);
                let at = signal.offset;
                (found, floats) = (found + 1, Self { at, max });
            }
            signals = rest;
        }
        assert!(found == 1);
        floats
    }

    /// Whether all four are finite and in range in this body.
    #[inline(always)]
    fn hold(&self, body: &[u8]) -> bool {
        let floats = body.get(self.at..).and_then(<[u8]>::first_chunk::<16>);
        // The bits of magnitudes compare like integers, and those of NaN are greater than any.
        let holds = |float: &[u8; 4]| u32::from_le_bytes(*float) << 1 <= self.max.to_bits() << 1;
        floats.is_some_and(|floats| floats.as_chunks().0.iter().all(holds))
    }
}

impl Feedback {
    /// Greatest speed of a shaft that a feedback can carry, rad/s.
    pub const MAX_VELOCITY: f32 = VELOCITY.max;
}

impl Packed<FEEDBACK_LEN> for Feedback {
    #[inline(always)]
    fn unpack(body: &[u8; FEEDBACK_LEN]) -> Option<Self> {
        let mut fields = Fields(body);
        let feedback = Self {
            sample: fields.one(u32::from_le_bytes)?,
            status: DriveStatus::from_bits(fields.one(u8::from_le_bytes)?)?,
            position: fields.four(i32::from_le_bytes)?,
            velocity: fields.four(f32::from_le_bytes)?,
            torque: fields.four(i16::from_le_bytes)?,
        };
        fields.0.is_empty().then_some(feedback)
    }

    fn pack(&self, body: &mut [u8; FEEDBACK_LEN]) -> Option<()> {
        let mut room = Room(body);
        room.one(self.sample.to_le_bytes())?;
        room.one(self.status.bits().to_le_bytes())?;
        room.four(self.position.map(i32::to_le_bytes))?;
        room.four(self.velocity.map(f32::to_le_bytes))?;
        room.four(self.torque.map(i16::to_le_bytes))?;
        room.0.is_empty().then_some(())
    }

    fn in_range(body: &[u8; FEEDBACK_LEN]) -> bool {
        VELOCITY.hold(body)
    }
}

impl Packed<COMMAND_LEN> for Command {
    fn unpack(body: &[u8; COMMAND_LEN]) -> Option<Self> {
        let mut fields = Fields(body);
        let command = Self {
            sample: fields.one(u32::from_le_bytes)?,
            control: ControlWord::from_bits(fields.one(u8::from_le_bytes)?)?,
            torque: fields.four(f32::from_le_bytes)?,
        };
        fields.0.is_empty().then_some(command)
    }

    fn pack(&self, body: &mut [u8; COMMAND_LEN]) -> Option<()> {
        let mut room = Room(body);
        room.one(self.sample.to_le_bytes())?;
        room.one(self.control.bits().to_le_bytes())?;
        room.four(self.torque.map(f32::to_le_bytes))?;
        room.0.is_empty().then_some(())
    }

    fn in_range(body: &[u8; COMMAND_LEN]) -> bool {
        TORQUE.hold(body)
    }
}

/// What is left to read. Lengths are constants where this is used, so the compiler resolves the checks.
struct Fields<'a>(&'a [u8]);

impl Fields<'_> {
    #[inline(always)]
    fn one<const N: usize, T>(&mut self, from: impl Fn([u8; N]) -> T) -> Option<T> {
        let (field, rest) = self.0.split_first_chunk()?;
        self.0 = rest;
        Some(from(*field))
    }

    #[inline(always)]
    fn four<const N: usize, T>(&mut self, from: impl Fn([u8; N]) -> T) -> Option<[T; 4]> {
        Some([
            self.one(&from)?,
            self.one(&from)?,
            self.one(&from)?,
            self.one(&from)?,
        ])
    }
}

/// What is left to write.
struct Room<'a>(&'a mut [u8]);

impl Room<'_> {
    #[inline(always)]
    fn one<const N: usize>(&mut self, field: [u8; N]) -> Option<()> {
        let (place, rest) = core::mem::take(&mut self.0).split_first_chunk_mut()?;
        *place = field;
        self.0 = rest;
        Some(())
    }

    #[inline(always)]
    fn four<const N: usize>(&mut self, fields: [[u8; N]; 4]) -> Option<()> {
        fields.into_iter().try_for_each(|field| self.one(field))
    }
}
