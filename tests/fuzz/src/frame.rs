//! Single frames.

use protocol::codec;
use protocol::frame::{CanFrame, ExtendedId, StandardId};
use protocol::schema::MessageInfo;
use protocol::table::TABLE;
use trace::fields::Decoded;

use crate::Bytes;

/// A frame of `info` with a body from `bytes`, protected as its sender would.
pub(crate) fn of_message(info: &MessageInfo, counter: u8, bytes: &mut Bytes) -> CanFrame {
    let mut data = vec![0; info.len];
    bytes.fill(&mut data[..info.body_len()]);
    if let Some(profile) = info.protection {
        profile.protect(info.id, counter, &mut data);
    }
    let id = StandardId::new(info.id).expect("identifiers of the table have 11 bits");
    let frame = if info.is_fd() {
        CanFrame::fd(id, &data, true)
    } else {
        CanFrame::classical(id, &data)
    };
    frame.expect("the table has lengths of frames")
}

/// A frame of any kind, which most likely means nothing.
pub(crate) fn of_any_kind(bytes: &mut Bytes) -> Option<CanFrame> {
    let (flags, id) = (bytes.byte(), u32::from_le_bytes(bytes.array()));
    let mut data = vec![0; usize::from(bytes.byte() % 65)];
    bytes.fill(&mut data);
    let frame = |id: protocol::frame::Id| match flags & 3 {
        0 => CanFrame::remote(id, data.len()),
        1 => CanFrame::classical(id, &data),
        _ => Some(CanFrame::fd(id, &data, flags & 8 != 0)?.with_esi(flags & 16 != 0)),
    };
    if flags & 4 == 0 {
        frame(StandardId::new(id as u16 & 0x7FF)?.into())
    } else {
        frame(ExtendedId::new(id & 0x1FFF_FFFF)?.into())
    }
}

/// What decodes is what encodes to the same bytes, and every field of it has a text.
pub(crate) fn frame(bytes: &[u8]) {
    let mut bytes = Bytes(bytes);
    let kind = bytes.byte();
    let frame = match TABLE.get(usize::from(kind)) {
        Some(info) => Some(of_message(info, bytes.byte(), &mut bytes)),
        None => of_any_kind(&mut bytes),
    };
    let Some(frame) = frame else {
        return;
    };
    match codec::decode(&frame) {
        Ok(received) => {
            let again = codec::encode(&received.message, received.counter.unwrap_or(0));
            // An emergency stop may also be empty, and the flags of the link are not the message's.
            if !frame.data().is_empty() {
                let again = again.expect("what was received can be sent");
                assert_eq!(again.data(), frame.data());
                assert_eq!(again.id(), frame.id());
            }
            let decoded = Decoded::new(&frame).expect("it has decoded");
            for field in decoded.fields() {
                for (_, _, value) in field.elements() {
                    let text = value.to_string();
                    assert!(!text.is_empty() && !text.contains("NaN") && text != "?");
                }
            }
        }
        Err(error) => {
            assert!(!error.to_string().is_empty());
            assert!(Decoded::new(&frame).is_err());
        }
    }
}
