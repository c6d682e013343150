//! What simulator and emulated board say to each other.

use channel::{
    GREETING_LEN, REPLY_HEADER, REQUEST_LEN, Request, SETUP_LEN, Setup, frame_from_bytes,
    frame_to_bytes, greeted, is_greeting, reply_header,
};

use crate::Bytes;

/// What is understood is written as what is understood in the same way.
pub(crate) fn board(bytes: &[u8]) {
    let mut bytes = Bytes(bytes);
    while !bytes.is_empty() {
        match bytes.byte() % 4 {
            0 => {
                if let Some(request) = Request::from_bytes(&bytes.array::<REQUEST_LEN>()) {
                    assert_eq!(Request::from_bytes(&request.to_bytes()), Some(request));
                }
            }
            1 => {
                if let Some(setup) = Setup::from_bytes(&bytes.array::<SETUP_LEN>()) {
                    assert!(setup.to_bytes().is_some());
                }
            }
            2 => {
                if let Some(frame) = frame_from_bytes(&bytes.array()) {
                    assert_eq!(frame_from_bytes(&frame_to_bytes(&frame)), Some(frame));
                }
            }
            _ => {
                let header = bytes.array::<REPLY_HEADER>();
                let _ = (is_greeting(&header), reply_header(&header));
                let _ = greeted(&bytes.array::<{ GREETING_LEN - REPLY_HEADER }>());
            }
        }
    }
}
