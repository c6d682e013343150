//! The controller's laws in the form of the paper: in continuous time, without friction and rotors.

use firmware::control::laws::{ControlInput, Gains, Memory, Motion, Selection};
use firmware::mechanics::arm::{ArmModel, DriveTrain, IRB_930};
use firmware::mechanics::body::Body;
use firmware::trajectory::{Rates, Reference, Setpoint};
use nalgebra::Vector4;
use protocol::messages::{Compensation, Law};

use crate::arm::{State, U32};
use crate::product::payload;

/// Links alone, as in the laws of the paper.
const DRIVE: DriveTrain = DriveTrain {
    rotor_inertia: Vector4::new(0.0, 0.0, 0.0, 0.0),
    viscous: Vector4::new(0.0, 0.0, 0.0, 0.0),
    coulomb: Vector4::new(0.0, 0.0, 0.0, 0.0),
    ..IRB_930.drive
};

const ARM: ArmModel = ArmModel {
    drive: DRIVE,
    ..IRB_930
};

/// A law with its model of arm and payload and its gains, critically damped.
pub(crate) struct Controller {
    selection: Selection,
    body: Body,
}

impl Controller {
    /// A law at a bandwidth (rad/s), with the payload of a table.
    pub(crate) fn new(law: Law, bandwidth: f64, label: &str) -> Self {
        let gains = Gains {
            bandwidth: bandwidth as f32,
            damping: 1.0,
            observer: 1.0,
        };
        let selection = Selection {
            law,
            compensation: Compensation::None,
            gains,
        };
        let body = Body::new(&ARM, &payload(label));
        Self { selection, body }
    }

    /// Joint efforts in a state, with the present reference: no delay to compensate.
    pub(crate) fn efforts(
        &self,
        reference: &State,
        (q, qd): (Vector4<f64>, Vector4<f64>),
    ) -> Vector4<f64> {
        let q = q.cast();
        let reference = Reference {
            q: reference.q.cast(),
            qd: reference.qd.cast(),
            qdd: reference.qdd.cast(),
        };
        let Reference {
            qd: wanted, qdd, ..
        } = reference;
        let ahead = Rates { qd: wanted, qdd };
        let setpoint = Setpoint { reference, ahead };
        let motion = Motion {
            q,
            qd: qd.cast(),
            torque: Vector4::zeros(),
            setpoint: &setpoint,
            velocity_error: wanted - qd.cast(),
            qd_ahead: qd.cast(),
            lead: 0.0,
            period: 1e-3,
            elapsed: 1e-3,
            error: &(setpoint.reference.q - q),
            excess: &Vector4::zeros(),
        };
        let input = ControlInput {
            motion: &motion,
            geometry: &ARM.geometry,
            body: &self.body,
        };
        let output = self.selection.torque(&input, &mut Memory::new());
        output.torque.cast()
    }
}

/// Effect of rounding position and velocity to f32 on a critically damped error equation (rad, m): positions up to 7
/// rad, and velocities `speed` over half the bandwidth, for state and reference each.
pub(crate) fn sensing_bound(speed: f64, bandwidth: f64) -> f64 {
    2.0 * U32 * (7.0 + 2.0 * speed / bandwidth)
}
