//! Messages in an MCAP file.

use foxglove::Encode;
use foxglove::bytes::Bytes;
use foxglove::messages::{
    FrameTransform, FrameTransforms, JointState, JointStates, Quaternion, Timestamp, Vector3,
};
use protocol::frame::FrameKind;
use protocol::table;
use sim::model::{AXES, Geometry};
use trace::Entry;

/// A time since 1970, or since the start of a run. Seconds end in 2106.
pub(super) fn time(micros: u64) -> Timestamp {
    let seconds = u32::try_from(micros / 1_000_000).unwrap_or(u32::MAX);
    Timestamp::new(seconds, (micros % 1_000_000) as u32 * 1000)
}

pub(super) fn nanos(time: Timestamp) -> u64 {
    u64::from(time.sec()) * 1_000_000_000 + u64::from(time.nsec())
}

/// A frame of a bus. Members are those of a [`protocol::frame::CanFrame`], or of a [`trace::Entry::Error`].
#[derive(Default, Encode)]
pub(super) struct CanFrame {
    timestamp: Option<Timestamp>,
    /// Identifier; of an error frame, its class.
    id: u32,
    extended: bool,
    fd: bool,
    /// Bit rate switch.
    brs: bool,
    /// Error state indicator.
    esi: bool,
    remote: bool,
    error: bool,
    /// Bytes; those that a remote frame asks for.
    length: u32,
    /// Name in the protocol, if it has one.
    message: &'static str,
    data: Bytes,
}

pub(super) fn can_frame(time: Timestamp, entry: &Entry) -> CanFrame {
    match entry {
        Entry::Frame(frame) => {
            let (fd, brs, esi, remote) = match frame.kind() {
                FrameKind::Classical { remote } => (false, false, false, remote),
                FrameKind::Fd { brs, esi } => (true, brs, esi, false),
            };
            CanFrame {
                timestamp: Some(time),
                id: frame.raw_id(),
                extended: frame.is_extended(),
                fd,
                brs,
                esi,
                remote,
                error: false,
                length: if remote {
                    frame.dlc().into()
                } else {
                    frame.data().len() as u32
                },
                message: table::of_frame(frame).map_or("", |info| info.name),
                data: Bytes::copy_from_slice(frame.data()),
            }
        }
        Entry::Error(error) => CanFrame {
            timestamp: Some(time),
            id: error.class,
            error: true,
            length: error.data().len() as u32,
            data: Bytes::copy_from_slice(error.data()),
            ..CanFrame::default()
        },
    }
}

/// States of the joints: rad, m; rad/s, m/s; N m, N.
pub(super) fn joint_states(
    time: Timestamp,
    q: &[f64; 4],
    qd: &[f64; 4],
    effort: Option<&[f64; 4]>,
) -> JointStates {
    let joint = |axis: usize| JointState {
        name: AXES[axis].into(),
        position: Some(q[axis]),
        velocity: Some(qd[axis]),
        acceleration: None,
        effort: effort.map(|effort| effort[axis]),
    };
    JointStates {
        timestamp: Some(time),
        joints: (0..AXES.len()).map(joint).collect(),
    }
}

/// From the base to the flange: a frame turns with each arm, one goes up and down with the shaft.
pub(super) fn transforms(time: Timestamp, geometry: &Geometry, q: &[f64; 4]) -> FrameTransforms {
    let Geometry { a1, a2, d1, d2, d4 } = *geometry;
    let [shoulder, elbow, lift, wrist] = *q;
    let chain = [
        ("base", "shoulder", [0.0, 0.0, 0.0], turn(shoulder)),
        ("shoulder", "elbow", [a1, 0.0, 0.0], turn(elbow)),
        ("elbow", "shaft", [a2, 0.0, d1 + d2 - lift], turn(0.0)),
        ("shaft", "flange", [0.0, 0.0, -d4], turn_downwards(-wrist)),
    ];
    let transforms = chain.map(|(parent, child, [x, y, z], rotation)| FrameTransform {
        timestamp: Some(time),
        parent_frame_id: parent.into(),
        child_frame_id: child.into(),
        translation: Some(Vector3 { x, y, z }),
        rotation: Some(rotation),
    });
    FrameTransforms {
        transforms: transforms.into(),
    }
}

/// About the vertical.
fn turn(angle: f64) -> Quaternion {
    let (z, w) = libm::sincos(angle / 2.0);
    Quaternion {
        x: 0.0,
        y: 0.0,
        z,
        w,
    }
}

/// About the vertical, then upside down, as the flange is.
fn turn_downwards(angle: f64) -> Quaternion {
    let (y, x) = libm::sincos(angle / 2.0);
    Quaternion {
        x,
        y,
        z: 0.0,
        w: 0.0,
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::{Isometry3, Quaternion, Translation3, UnitQuaternion, Vector4};
    use proptest::prelude::*;
    use sim::model::RobotModel;
    use sim::plant::arm::Arm;

    use super::{time, transforms};

    proptest! {
        /// One after the other, the frames lead to the flange of the plant.
        #[test]
        fn the_frames_end_at_the_flange(q in prop::array::uniform4(-2.0_f64..2.0)) {
            let model = RobotModel::irb_930_22_105();
            let mut flange = Isometry3::identity();
            for step in transforms(time(0), &model.geometry, &q).transforms {
                let (t, r) = (step.translation.unwrap(), step.rotation.unwrap());
                flange *= Isometry3::from_parts(
                    Translation3::new(t.x, t.y, t.z),
                    UnitQuaternion::new_unchecked(Quaternion::new(r.w, r.x, r.y, r.z)),
                );
            }
            let arm = Arm::new(&model, None);
            let (origin, rotation) = arm.flange(&arm.at(&Vector4::from(q)));
            prop_assert!((flange.translation.vector - origin).norm() < 1e-12);
            let turned = flange.rotation.to_rotation_matrix().into_inner();
            prop_assert!((turned - rotation).norm() < 1e-12);
        }
    }
}
