//! Whatever one end of the channel writes, the other reads back.

#![allow(
    clippy::expect_used,
    clippy::indexing_slicing,
    clippy::panic,
    clippy::unwrap_used,
    reason = "a test fails by panicking"
)]

use channel::{
    Channel, FRAME_LEN, Fault, Measured, REPLY_FRAMES, REPLY_HEADER, Reply, Request, Setup,
    frame_from_bytes, frame_to_bytes, greeted, greeting, is_greeting, reply_header,
};
use firmware::cabinet::reset::Stop;
use firmware::control::controller::Config;
use firmware::control::phase::Phase;
use firmware::mechanics::arm::IRB_930;
use proptest::prelude::*;
use protocol::bus::TransmitError;
use protocol::frame::{CanFrame, ExtendedId, Id, StandardId};
use protocol::messages::ResetReason;
use protocol::time::{Instant, Period};

fn any_frame() -> impl Strategy<Value = CanFrame> {
    let id = prop_oneof![
        (0..=StandardId::MAX.as_raw())
            .prop_filter_map("11 bits", StandardId::new)
            .prop_map(Id::Standard),
        (0..=ExtendedId::MAX.as_raw())
            .prop_filter_map("29 bits", ExtendedId::new)
            .prop_map(Id::Extended),
    ];
    let data = proptest::collection::vec(any::<u8>(), 0..=64);
    (id, data, any::<(bool, bool)>(), 0..3).prop_filter_map(
        "too long",
        |(id, data, (brs, esi), kind)| match kind {
            0 => CanFrame::classical(id, &data[..data.len().min(8)]),
            1 => CanFrame::remote(id, data.len() % 9),
            _ => CanFrame::fd(id, &data, brs).map(|frame| frame.with_esi(esi)),
        },
    )
}

proptest! {
    #[test]
    fn every_frame_comes_back(frame in any_frame()) {
        prop_assert_eq!(frame_from_bytes(&frame_to_bytes(&frame)), Some(frame));
    }

    #[test]
    fn every_request_comes_back(now: u64, frame in proptest::option::of(any_frame())) {
        let now = Instant::from_nanos(now);
        let request = Request::Poll { now, frame };
        prop_assert_eq!(Request::from_bytes(&request.to_bytes()), Some(request));
        let took = Request::Took(now.since(Instant::ORIGIN));
        for request in [Request::BusOff, Request::Stack, took] {
            prop_assert_eq!(Request::from_bytes(&request.to_bytes()), Some(request));
        }
    }

    #[test]
    fn any_record_is_a_frame_or_none(bytes in proptest::array::uniform32(any::<u8>())) {
        let mut record = [0; FRAME_LEN];
        record[..32].copy_from_slice(&bytes);
        if let Some(frame) = frame_from_bytes(&record) {
            prop_assert_eq!(frame_from_bytes(&frame_to_bytes(&frame)), Some(frame));
        }
    }
}

/// Layout of `struct canfd_frame` in linux/can.h, written out by hand.
#[test]
fn frames_have_the_layout_of_linux() {
    let id = ExtendedId::new(0x18FF_1234).unwrap();
    let bytes = frame_to_bytes(&CanFrame::fd(id, &[1, 2, 3], true).unwrap());
    assert_eq!(
        bytes[..12],
        [0x34, 0x12, 0xFF, 0x98, 3, 5, 0, 0, 1, 2, 3, 0]
    );
}

#[test]
fn the_configuration_comes_back_to_the_bit() {
    let mut config = Config::new(IRB_930, Period::of_rate(1000.0));
    config.setup.command_delay = 2.345e-4;
    config.arm.geometry.a2 = f32::from_bits(0x3EFA_E148);
    for channel in [Channel::Fifo, Channel::Uart] {
        let setup = Setup { channel, config };
        assert_eq!(Setup::from_bytes(&setup.to_bytes().unwrap()), Some(setup));
    }
}

#[test]
fn every_planted_fault_comes_back() {
    for fault in Fault::ALL {
        let request = Request::Plant(fault);
        assert_eq!(Request::from_bytes(&request.to_bytes()), Some(request));
    }
    let mut bytes = Request::Plant(Fault::Panic).to_bytes();
    bytes[1] += 1;
    assert_eq!(Request::from_bytes(&bytes), None);
}

#[test]
fn a_greeting_comes_back_and_is_no_reply() {
    let stop = Stop {
        reason: ResetReason::HardFault,
        pins: [7, 8],
        at: 0x0102_0304,
        status: 0x8000_0010,
    };
    let bytes = greeting(&stop);
    let (header, rest) = bytes.split_first_chunk().unwrap();
    assert!(is_greeting(header));
    assert_eq!(greeted(rest.first_chunk().unwrap()), Some(stop));
    assert!(!is_greeting(
        Reply::new().finish(&u32::MAX.into()).first_chunk().unwrap()
    ));
}

#[test]
fn a_full_reply_refuses_one_more() {
    let frame = CanFrame::classical(StandardId::ZERO, &[7]).unwrap();
    let mut reply = Reply::new();
    for _ in 0..REPLY_FRAMES {
        reply.push(&frame).unwrap();
    }
    assert_eq!(reply.push(&frame), Err(TransmitError::QueueFull));
    let mut measured = Measured::from(9);
    measured.phases = [(); Phase::ALL.len()].map(|()| {
        measured.number += 1;
        measured.number
    });
    let bytes = reply.finish(&measured);
    assert_eq!(bytes.len(), REPLY_HEADER + REPLY_FRAMES * FRAME_LEN);
    assert_eq!(
        reply_header(bytes.first_chunk().unwrap()),
        (REPLY_FRAMES as u32, measured)
    );
}
