//! Reference magnitude for errors in the dynamics.
//!
//! The error of an f32 computation is a number of roundings times u = 2^-24 times the sum of the magnitudes of its
//! terms, not times the result, in which they may cancel. [`effort`] is that sum for the joint efforts: the
//! Newton-Euler recursion carried out on lengths. Rotation preserves length, so every horizontal vector is replaced by
//! its length, every sum by the sum of lengths, every product by the product of lengths.
//!
//! Roundings on the longest path, from a joint acceleration at the base out to the tool and back:
//!
//! | | Newton-Euler | |
//! |---|---|---|
//! | outwards, a frame | 7 turn (3.5 sine and cosine, 3 sums), 5 acceleration of the next origin | 4 x 12 |
//! | at a body | 1 centre of mass, 4 its acceleration, 1 mass, 4 moment | 10 |
//! | inwards, a frame | 7 turn, 4 moment, 1 sum with the body | 4 x 12 |
//! | | | 106 |
//!
//! Lagrange's closed form has 32 (see its own documentation), on terms that are the same products of lengths, except that it
//! has |x| + |y| for the length of a first moment of mass, at most sqrt 2 times it: 46.

use firmware::mechanics::arm::{ArmModel, Payload};
use nalgebra::{Matrix4, Vector4};

/// Roundings of the recursive Newton-Euler algorithm.
pub(crate) const NEWTON_EULER: f64 = 106.0;

/// Roundings of Lagrange's closed form.
pub(crate) const LAGRANGE: f64 = 46.0;

struct Body {
    mass: f64,
    inertia: f64,
    /// Distance of the centre of mass from the origin of its frame, as the sum of the terms it is computed from.
    distance: f64,
}

/// Sum of the magnitudes of all terms of the joint efforts.
pub(crate) fn effort(
    arm: &ArmModel,
    payload: &Payload,
    gravity: f32,
    qd: &Vector4<f64>,
    qdd: &Vector4<f64>,
) -> Vector4<f64> {
    let geometry = &arm.geometry;
    let lengths = [geometry.a1, geometry.a2, 0.0, 0.0].map(f64::from);
    let turning = [1.0, 1.0, 0.0, 1.0];

    // Outwards: turning rate, turning acceleration, horizontal acceleration of each origin.
    let (mut rate, mut angular, mut linear) = (0.0, 0.0, 0.0);
    let mut force = [0.0; 4];
    let mut moment = [0.0; 4];
    for i in 0..4 {
        rate += turning[i] * qd[i].abs();
        angular += turning[i] * qdd[i].abs();
        linear += (angular + rate * rate) * lengths[i];

        let link = &arm.links[i];
        let body = |mass: f32, x: f32, y: f32, inertia: f32, length: f64| Body {
            mass: mass.into(),
            inertia: inertia.into(),
            distance: f64::from(x).hypot(y.into()) + length,
        };
        let mut bodies = vec![body(
            link.mass,
            link.com.x,
            link.com.y,
            link.inertia.z,
            lengths[i],
        )];
        if i == 3 {
            bodies.push(body(
                payload.mass,
                payload.com.x,
                payload.com.y,
                payload.inertia.z,
                0.0,
            ));
        }
        for body in bodies {
            let push = body.mass * (linear + (angular + rate * rate) * body.distance);
            force[i] += push;
            moment[i] += body.inertia * angular + body.distance * push;
        }
    }

    // Inwards: load carried by each joint.
    let (mut carried_force, mut carried_moment) = (0.0, 0.0);
    let mut effort = Vector4::zeros();
    for i in (0..4).rev() {
        carried_force += force[i];
        carried_moment += moment[i] + lengths[i] * carried_force;
        effort[i] = carried_moment;
    }
    let lift_mass =
        f64::from(arm.links[2].mass) + f64::from(arm.links[3].mass) + f64::from(payload.mass);
    effort[2] = lift_mass * (qdd.z.abs() + f64::from(gravity));
    effort
}

/// The same for the mass matrix: column by column for unit accelerations.
pub(crate) fn mass_matrix(arm: &ArmModel, payload: &Payload) -> Matrix4<f64> {
    let mut mass = Matrix4::zeros();
    for joint in 0..4 {
        let mut unit = Vector4::zeros();
        unit[joint] = 1.0;
        let mut column = effort(arm, payload, 0.0, &Vector4::zeros(), &unit);
        // The lift and the turning joints are not coupled.
        if joint != 2 {
            column.z = 0.0;
        }
        mass.set_column(joint, &column);
    }
    mass
}
