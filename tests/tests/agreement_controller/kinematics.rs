//! Positions and velocities of the tool.

use super::*;

#[test]
fn forward_kinematics() {
    for row in Table::load("kinematics.csv").rows() {
        let state = State::of(&row, &["q"]);
        let [q, ..] = &state.narrow;
        let pose = forward(&IRB_930.geometry, q);
        let planar = (POSITION + state.angles()) * U * REACH;
        // The lift and d4 are rounded, and so are their sums: 4 u of at most 0.43 m.
        let bound = Vector3::new(planar, planar, 4.0 * U * 0.43);
        let expected = Vector3::new(row.f64("x"), row.f64("y"), row.f64("z"));
        agree(
            &row,
            "position",
            Vector3::new(pose.x, pose.y, pose.z),
            expected,
            bound,
        );

        // Each angle rounded, two sums no greater than the magnitudes, the wrap 2 u pi.
        let off = turn_between(pose.yaw.into(), row.f64("yaw")).abs();
        assert!(
            off <= (3.0 * state.angles() + 2.0 * PI) * U,
            "{row}: yaw {} is off by {off:e}",
            pose.yaw
        );

        // 9.1 u and 2.5 u of the sines, each times sine and cosine of the other angle (sqrt 2 in all), 2 of the sum.
        let bound = SMatrix::repeat((19.0 + state.angles()) * U);
        agree(
            &row,
            "R",
            rotation(&Trig::new(q)),
            row.matrix::<3, 3>("R"),
            bound,
        );
    }
}

#[test]
fn differential_kinematics() {
    for row in Table::load("kinematics.csv").rows() {
        let state = State::of(&row, &["q", "qd"]);
        let [q, qd, _] = &state.narrow;
        let trig = Trig::new(q);
        let jacobian = Jacobian::new(&IRB_930.geometry, &trig);
        let element = (POSITION + state.angles()) * U * REACH;
        agree(
            &row,
            "J",
            jacobian.geometric(),
            row.matrix::<6, 4>("J"),
            SMatrix::repeat(element),
        );

        // An element's error and 3 roundings of product, sum and speed.
        let [_, speed, _] = state.wide.map(|vector| vector.abs());
        let linear = (element + 3.0 * U * REACH) * (speed.x + speed.y);
        let twist = Vector4::new(row.f64("vx"), row.f64("vy"), row.f64("vz"), row.f64("wz"));
        let bound = Vector4::new(
            linear,
            linear,
            U * speed.z,
            4.0 * U * (speed.x + speed.y + speed.w),
        );
        agree(&row, "twist", jacobian.task_velocity(qd), twist, bound);

        let [_, _, _, flange] = propagate(&link_frames(&IRB_930.geometry, &trig, q.z), qd);
        let turn = rotation(&trig);
        // Four turns out and one back: the sines once more each, 3 sums in each.
        let linear = linear + 5.0 * (3.5 + 3.0 + state.angles()) * U * REACH * (speed.x + speed.y);
        let bound = Vector3::new(linear, linear, 3.0 * U * speed.z);
        agree(
            &row,
            "propagated velocity",
            turn * flange.linear,
            twist.xyz(),
            bound,
        );
        let turning = Vector3::new(row.f64("wx"), row.f64("wy"), row.f64("wz"));
        let bound = Vector3::new(0.0, 0.0, 8.0 * U * (speed.x + speed.y + speed.w));
        agree(
            &row,
            "propagated turning",
            turn * flange.angular,
            turning,
            bound,
        );

        // Squared rates: 2 u of each speed and 2 of their sum; the elements; the difference, product and sum.
        let squares = speed.x.powi(2) + (speed.x + speed.y).powi(2);
        let bias = (2.0 * element + 8.0 * U * REACH) * squares;
        let expected: Vector4<f64> = row.vector::<6>("Jdqd").fixed_rows::<4>(0).into();
        agree(
            &row,
            "Jdot qd",
            jacobian.bias(qd),
            expected,
            Vector4::new(bias, bias, 0.0, 0.0),
        );
    }
}
