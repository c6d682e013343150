//! Frames have the lengths of ISO 11898-1, and an impossible frame cannot be built.

#![allow(
    clippy::expect_used,
    clippy::indexing_slicing,
    clippy::panic,
    clippy::unwrap_used,
    reason = "a test fails by panicking"
)]

use proptest::prelude::*;
use protocol::frame::{
    CanFrame, ExtendedId, FrameKind, Id, StandardId, fd_length, fd_length_of_dlc,
};

fn id() -> impl Strategy<Value = Id> {
    prop_oneof![
        (0..=0x7FFu16).prop_map(|raw| Id::Standard(StandardId::new(raw).unwrap())),
        (0..=0x1FFF_FFFFu32).prop_map(|raw| Id::Extended(ExtendedId::new(raw).unwrap())),
    ]
}

/// ISO 11898-1:2015, coding of the data length code in FD frames.
const ISO: [usize; 16] = [0, 1, 2, 3, 4, 5, 6, 7, 8, 12, 16, 20, 24, 32, 48, 64];

#[test]
fn lengths_are_those_of_the_standard() {
    for (dlc, &len) in ISO.iter().enumerate() {
        assert_eq!(fd_length_of_dlc(dlc as u8), Some(len));
        let frame = CanFrame::fd(StandardId::ZERO, &[0xAA; 64][..len], true).unwrap();
        assert_eq!((frame.dlc(), frame.data().len()), (dlc as u8, len));
    }
    assert_eq!(fd_length_of_dlc(16), None);
    for len in 0..=70 {
        assert_eq!(
            fd_length(len),
            ISO.into_iter().find(|&iso| iso >= len),
            "{len}"
        );
    }
}

#[test]
fn impossible_frames_are_refused() {
    assert_eq!(CanFrame::classical(StandardId::ZERO, &[0; 9]), None);
    assert_eq!(CanFrame::remote(StandardId::ZERO, 9), None);
    assert_eq!(CanFrame::fd(StandardId::ZERO, &[0; 65], false), None);
}

#[test]
fn prints_as_candump_does() {
    let id = StandardId::new(0x1C0).unwrap();
    let text = |frame: Option<CanFrame>| format!("{}", frame.unwrap());
    assert_eq!(text(CanFrame::classical(id, &[1, 0xFE])), "1C0#01FE");
    assert_eq!(text(CanFrame::remote(id, 8)), "1C0#R8");
    assert_eq!(
        text(CanFrame::fd(id, &[7], true).map(|f| f.with_esi(true))),
        "1C0##307"
    );
    assert_eq!(
        text(CanFrame::classical(ExtendedId::new(0x1C0).unwrap(), &[])),
        "000001C0#"
    );
}

/// A minimal foreign frame type, as in a chip driver.
#[derive(Clone, PartialEq, Debug)]
struct Driver(Id, bool, Vec<u8>);

impl embedded_can::Frame for Driver {
    fn new(id: impl Into<Id>, data: &[u8]) -> Option<Self> {
        (data.len() <= 8).then(|| Self(id.into(), false, data.to_vec()))
    }
    fn new_remote(id: impl Into<Id>, dlc: usize) -> Option<Self> {
        (dlc <= 8).then(|| Self(id.into(), true, vec![0; dlc]))
    }
    fn is_extended(&self) -> bool {
        matches!(self.0, Id::Extended(_))
    }
    fn is_remote_frame(&self) -> bool {
        self.1
    }
    fn id(&self) -> Id {
        self.0
    }
    fn dlc(&self) -> usize {
        self.2.len()
    }
    fn data(&self) -> &[u8] {
        if self.1 { &[] } else { &self.2 }
    }
}

proptest! {
    #[test]
    fn fd_keeps_the_data_and_pads_with_zeros(id in id(), data in prop::collection::vec(any::<u8>(), 0..=64), brs: bool, esi: bool) {
        let frame = CanFrame::fd(id, &data, brs).unwrap().with_esi(esi);
        prop_assert_eq!(frame.id(), id);
        prop_assert_eq!(frame.kind(), FrameKind::Fd { brs, esi });
        prop_assert_eq!((frame.brs(), frame.esi()), (brs, esi));
        prop_assert_eq!(&frame.data()[..data.len()], &data[..]);
        prop_assert!(frame.data()[data.len()..].iter().all(|&byte| byte == 0));
        prop_assert_eq!(frame.to_embedded::<Driver>(), None);
    }

    #[test]
    fn classical_frames_survive_a_driver_type(id in id(), data in prop::collection::vec(any::<u8>(), 0..=8), remote: bool) {
        let frame = if remote { CanFrame::remote(id, data.len()) } else { CanFrame::classical(id, &data) }.unwrap();
        prop_assert_eq!(usize::from(frame.dlc()), data.len());
        prop_assert_eq!(frame.with_esi(true), frame);
        prop_assert!(!frame.brs() && !frame.esi());
        let driver: Driver = frame.to_embedded().unwrap();
        prop_assert_eq!(CanFrame::from_embedded(&driver), Some(frame));
    }
}
