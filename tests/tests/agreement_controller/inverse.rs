//! Joint positions for a pose.

use super::*;

/// theta2 of the exact half-angle form.
fn bend(radius: f64) -> f64 {
    let fold = A1 - A2;
    let (short, over) = ((REACH - radius).max(0.0), (radius - fold).max(0.0));
    2.0 * (short * (REACH + radius))
        .sqrt()
        .atan2((over * (radius + fold)).sqrt())
}

fn target(row: &Row<'_>) -> Pose {
    let [x, y, z, yaw] = ["x", "y", "z", "yaw"].map(|column| row.f64(column) as f32);
    Pose { x, y, z, yaw }
}

/// The two solutions of a row: elbow, columns, flag.
const SOLUTIONS: [(Elbow, &str, &str); 2] = [
    (Elbow::Positive, "a_q", "a_in_limits"),
    (Elbow::Negative, "b_q", "b_in_limits"),
];

/// The error of theta2 comes from that of the radius, whatever the posture: it is bounded by the bends of a radius
/// longer and shorter by that error. Close to the stretched arm this allows 1e-3 rad, which corresponds to a micrometre
/// of radius; the pose of the solution still has to be right to the micrometre.
#[test]
fn inverse_kinematics() {
    for row in Table::load("ik.csv").rows() {
        let pose = target(&row);
        let (x, y) = (row.f64("x"), row.f64("y"));
        let radius = x.hypot(y);
        // Target 1 u, hypot 2 u, lengths and their sum 2 u, clamped by REACH_TOLERANCE.
        let slack = (5.0 * U + f64::from(REACH_TOLERANCE)) * REACH;

        for (elbow, columns, flag) in SOLUTIONS {
            let found = solve(&IRB_930.geometry, &pose, elbow);
            if matches!(row.text("reason"), "too_far" | "inside_hole") {
                match (row.text("reason"), found) {
                    ("too_far", Err(IkError::TooFar { .. }))
                    | ("inside_hole", Err(IkError::TooNear { .. })) => {}
                    (reason, found) => panic!("{row}: {reason}, but found {found:?}"),
                }
                continue;
            }
            let found = found.unwrap_or_else(|error| panic!("{row}: {error}"));
            let expected = row.vector::<4>(columns);

            let exact = bend(radius);
            let spread = (bend(radius - slack) - exact).max(exact - bend(radius + slack));
            // 8 u for two roots, their quotient and the arc tangent.
            let theta2 = spread + 8.0 * U * exact;
            // The angle at the shoulder follows theta2 at the rate a2 (a1 cos + a2) / r^2; two arc tangents, their
            // difference, the wrap and the target's error add 12 u of pi.
            let theta1 = theta2 * A2 * REACH / radius.powi(2) + 12.0 * U * PI;
            // Two sums of up to 9 rad, the target's yaw, the wrap.
            let theta4 = theta1 + theta2 + (2.0 * 9.0 + 3.0 * PI) * U;
            let mut actual = found;
            for (joint, bound) in [(0, theta1), (3, theta4)] {
                // At the seam either end of (-pi, pi] is right.
                let off = turn_between(found[joint].into(), expected[joint]);
                assert!(
                    off.abs() <= bound,
                    "{row}: {columns}{} is off by {off:e}, allowed {bound:e}",
                    joint + 1
                );
                actual[joint] = expected[joint] as f32;
            }
            // The remaining error of theta1 and theta4 is their rounding.
            let bound = Vector4::new(U * PI, theta2, 4.0 * U * 0.43, U * PI);
            agree(&row, columns, actual, expected, bound);

            let reached = forward(&IRB_930.geometry, &found);
            let gap = (f64::from(reached.x) - x).hypot(f64::from(reached.y) - y);
            // Radius, plus a shoulder angle and a forward computation.
            let bound = slack + (12.0 * PI + 8.0 * PI + 2.0 * POSITION) * U * REACH;
            assert!(
                gap <= bound,
                "{row}: {elbow:?} misses the target by {gap:e} m, allowed {bound:e}"
            );

            check_limits(&row, &pose, elbow, columns, flag);
        }
    }
}

/// With limits: the table's flag, and for a refusal the first axis that the table's own solution takes past its limit.
fn check_limits(row: &Row<'_>, pose: &Pose, elbow: Elbow, columns: &str, flag: &str) {
    let result = inverse(&IRB_930, pose, elbow, &Vector4::zeros());
    assert_eq!(
        result.is_ok(),
        row.flag(flag),
        "{row}: {flag}, but found {result:?}"
    );
    let Err(error) = result else { return };
    let limits = &IRB_930.limits;
    let solution = narrow(row.vector::<4>(columns));
    let passed = Axis::ALL.into_iter().find_map(|axis| {
        let (lower, upper, value) = (
            axis.of(&limits.lower),
            axis.of(&limits.upper),
            axis.of(&solution),
        );
        let limit = if value < lower { lower } else { upper };
        (value < lower || value > upper).then_some((axis, limit))
    });
    match error {
        IkError::Limit { axis, limit, .. } => {
            assert_eq!(Some((axis, limit)), passed, "{row}: {elbow:?}")
        }
        other => panic!("{row}: {other}"),
    }
}
