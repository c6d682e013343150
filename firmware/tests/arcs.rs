//! Arcs of the tool, against the circle through their three points, and against the limits of the robot.

#![allow(
    clippy::expect_used,
    clippy::indexing_slicing,
    clippy::panic,
    clippy::unwrap_used,
    reason = "a test fails by panicking"
)]

mod common;

use common::planned::{check, plan, plan_with, robot, two_kg};
use firmware::mechanics::arm::{IRB_930, Payload};
use firmware::mechanics::kinematics::{self, Elbow, Pose};
use firmware::trajectory::Trajectory;
use firmware::trajectory::planner::Planner;
use firmware::trajectory::request::Target;
use nalgebra::{Vector3, Vector4};
use proptest::prelude::*;
use protocol::messages::{ElbowSide, Posture, RefusalReason, WristTurn};

type Point = Vector3<f64>;

fn size(vector: Point) -> f64 {
    vector.dot(&vector).sqrt()
}

/// An arc to ask for: where the arm stands, and the other two points.
#[derive(Clone, Copy, Debug)]
struct Asked {
    from: Vector4<f32>,
    via: Vector3<f32>,
    end: Pose,
}

impl Asked {
    fn target(&self) -> Target {
        Target::Arc(self.via, self.end, Posture::NEAREST)
    }

    /// The three points.
    fn points(&self) -> [Point; 3] {
        let start = tool(&self.from);
        let end = Vector3::new(self.end.x, self.end.y, self.end.z);
        [start, self.via.cast(), end.cast()]
    }
}

/// The flange by the lengths of the arms, in f64.
fn tool(q: &Vector4<f32>) -> Point {
    let geometry = &IRB_930.geometry;
    let [one, two, lift] = [q.x, q.y, q.z].map(f64::from);
    let [a, b, d1, d4] = [geometry.a1, geometry.a2, geometry.d1, geometry.d4].map(f64::from);
    Point::new(
        a * one.cos() + b * (one + two).cos(),
        a * one.sin() + b * (one + two).sin(),
        d1 - d4 - lift,
    )
}

/// The circle through three points: centre by barycentric coordinates of the triangle, normal of its plane, radius.
struct Circle {
    centre: Point,
    normal: Point,
    radius: f64,
    start: Point,
}

impl Circle {
    fn through([a, b, c]: [Point; 3]) -> Self {
        let [aa, bb, cc] = [(b - c), (c - a), (a - b)].map(|side| side.dot(&side));
        let weights = [
            aa * (bb + cc - aa),
            bb * (cc + aa - bb),
            cc * (aa + bb - cc),
        ];
        let sum: f64 = weights.iter().sum();
        let centre = (a * weights[0] + b * weights[1] + c * weights[2]) / sum;
        let normal = (b - a).cross(&(c - b));
        Self {
            centre,
            normal: normal / size(normal),
            radius: size(a - centre),
            start: a,
        }
    }

    /// Distance of a point from the circle.
    fn distance(&self, point: &Point) -> f64 {
        let offset = point - self.centre;
        let above = offset.dot(&self.normal);
        let across = size(offset - self.normal * above) - self.radius;
        above.hypot(across)
    }

    /// Angle from the start to a point, the way round on which the second point comes before the third.
    fn angle(&self, point: &Point) -> f64 {
        let (from, to) = (self.start - self.centre, point - self.centre);
        let angle = from.cross(&to).dot(&self.normal).atan2(from.dot(&to));
        angle.rem_euclid(std::f64::consts::TAU)
    }
}

/// A circle of any size in a plane of any slope, or a level one, of which the arc goes up to nearly all the way round.
fn arcs(radius: std::ops::Range<f64>) -> impl Strategy<Value = Asked> {
    (
        (0.3f64..1.0, -2.0f64..2.0, any::<bool>()),
        (
            radius,
            -3.1f64..3.1,
            prop_oneof![Just(0.0), -1.5f64..1.5],
            -3.1f64..3.1,
        ),
        (0.1f64..6.1, 0.1f64..0.9, any::<bool>()),
        -2.0f32..2.0,
    )
        .prop_filter_map(
            "in reach",
            |((r, a, positive), (radius, heading, slope, tilt), (angle, share, back), yaw)| {
                let start = Point::new(r * a.cos(), r * a.sin(), -0.25);
                let out = Point::new(heading.cos(), heading.sin(), 0.0);
                let level = Point::new(-heading.sin(), heading.cos(), 0.0);
                let side = level * slope.cos() + Point::new(0.0, 0.0, slope.sin());
                let (first, second) = (
                    out * tilt.cos() + side * tilt.sin(),
                    side * tilt.cos() - out * tilt.sin(),
                );
                let turn = |angle: f64| {
                    let angle = if back { -angle } else { angle };
                    start + (first * (angle.cos() - 1.0) + second * angle.sin()) * radius
                };
                let (via, end) = (turn(share * angle), turn(angle));
                let pose = |p: &Point, yaw| Pose {
                    x: p.x as f32,
                    y: p.y as f32,
                    z: p.z as f32,
                    yaw,
                };
                let elbow = if positive {
                    Elbow::Positive
                } else {
                    Elbow::Negative
                };
                let from =
                    kinematics::inverse(&IRB_930, &pose(&start, 0.0), elbow, &Vector4::zeros())
                        .ok()?;
                Some(Asked {
                    from,
                    via: via.map(|x| x as f32),
                    end: pose(&end, yaw),
                })
            },
        )
}

fn at(trajectory: &Trajectory, k: u16, of: u16) -> Vector4<f32> {
    let t = trajectory.duration() * f32::from(k) / f32::from(of);
    trajectory
        .at(&IRB_930, t)
        .expect("a planned path stays in reach")
        .q
}

proptest! {
    #![proptest_config(common::draws::cases(500))]

    #[test]
    fn arcs_keep_every_limit(arm in robot(), asked in arcs(0.005..0.4), mass in 0.0f32..22.0, speed in 0.05f32..1.0) {
        let payload = Payload { mass, ..two_kg() };
        let Ok(trajectory) = plan(&arm, &payload, &asked.from, asked.target(), speed) else { return Ok(()) };
        check(&arm, &payload, &trajectory)?;
    }

    /// On the circle, forwards only, through the point on the way, and to the end.
    #[test]
    fn the_tool_follows_the_circle(asked in arcs(0.005..0.4)) {
        let Ok(trajectory) = plan(&IRB_930, &two_kg(), &asked.from, asked.target(), 1.0) else { return Ok(()) };
        let [start, via, end] = asked.points();
        let circle = Circle::through([start, via, end]);
        let (first, second, chord) = (via - start, end - via, end - start);
        let longest = size(first).max(size(second)).max(size(chord));
        let height = size(first.cross(&chord)) / longest;
        // f32 kinematics there and back; and what a few roundings of a start near the other points turn the circle by.
        let bound = 2e-6 + 4e-7 * circle.radius / height;
        let (mut angle, mut nearest) = (0.0, f64::MAX);
        for k in 0..=1000 {
            let place = tool(&at(&trajectory, k, 1000));
            let aside = circle.distance(&place);
            prop_assert!(aside < bound, "{k}: {aside} m aside, {bound}");
            if k > 0 && k < 1000 {
                let next = circle.angle(&place);
                // The first and the last thousandths are less than rounding.
                let rounding = 4.0 * bound / circle.radius;
                let next = if next > std::f64::consts::TAU - 0.01 - rounding && angle < 0.1 { 0.0 } else { next };
                prop_assert!(next > angle - rounding, "{k}: {next} after {angle}");
                angle = next;
            }
            nearest = f64::min(nearest, size(place - via));
        }
        let last = tool(&trajectory.end);
        prop_assert!(size(last - end) < 2e-6, "{}", size(last - end));
        let whole = circle.angle(&end);
        prop_assert!((angle - whole).abs() < 0.01, "{angle} of {whole}");
        // Two of these places are less than a two-hundredth of the way apart.
        prop_assert!(nearest < whole * circle.radius / 300.0 + bound, "{nearest} from via");
    }

    /// The yaw turns in proportion to the way.
    #[test]
    fn the_tool_turns_evenly(asked in arcs(0.02..0.3)) {
        let Ok(trajectory) = plan(&IRB_930, &two_kg(), &asked.from, asked.target(), 1.0) else { return Ok(()) };
        let circle = Circle::through(asked.points());
        let whole = circle.angle(&asked.points()[2]);
        let yaw = |q: &Vector4<f32>| f64::from(q.x + q.y - q.w);
        let (begin, end) = (yaw(&asked.from), yaw(&trajectory.end));
        prop_assert!((end - begin).abs() < 3.2);
        for k in 1..100 {
            let q = at(&trajectory, k, 100);
            let share = circle.angle(&tool(&q)) / whole;
            prop_assume!(share < 1.01);
            let expected = begin + (end - begin) * share;
            prop_assert!((yaw(&q) - expected).abs() < 1e-3, "{k}: {} {expected}", yaw(&q));
        }
    }

    /// Between the points that planning looks at, no joint leaves its range by more than rounding, or where its turning points are not
    /// looked for, by more than those of a line do.
    #[test]
    fn an_arc_stays_inside_the_ranges_between_its_points(asked in arcs(0.05..0.5)) {
        let Ok(trajectory) = plan(&IRB_930, &two_kg(), &asked.from, asked.target(), 1.0) else { return Ok(()) };
        let limits = &IRB_930.limits;
        for k in 0..=4000 {
            let q = at(&trajectory, k, 4000);
            let past = (limits.lower - q).sup(&(q - limits.upper));
            prop_assert!(past.y < 1e-5 && past.max() < 1e-3, "{past} past the limits at {q}");
        }
    }

    /// What the request says of the end holds for an arc as for a line.
    #[test]
    fn elbow_and_turn_are_kept(asked in arcs(0.05..0.3)) {
        let Ok(trajectory) = plan(&IRB_930, &two_kg(), &asked.from, asked.target(), 1.0) else { return Ok(()) };
        prop_assert_eq!(Elbow::of(&trajectory.end), Elbow::of(&asked.from));
        let (keep, other) = match Elbow::of(&asked.from) {
            Elbow::Positive => (ElbowSide::Positive, ElbowSide::Negative),
            Elbow::Negative => (ElbowSide::Negative, ElbowSide::Positive),
        };
        let ask = |elbow, turn| {
            let target = Target::Arc(asked.via, asked.end, Posture { elbow, turn });
            plan(&IRB_930, &two_kg(), &asked.from, target, 1.0)
        };
        let kept = ask(keep, WristTurn::Nearest).unwrap();
        prop_assert_eq!(kept.end, trajectory.end);
        let refused = ask(other, WristTurn::Nearest).unwrap_err();
        prop_assert!(matches!(refused.reason, RefusalReason::ElbowSide | RefusalReason::JointLimit), "{:?}", refused);
        if let Ok(turned) = ask(ElbowSide::Keep, WristTurn::PlusOne) {
            prop_assert!((turned.end.w - std::f32::consts::TAU).abs() <= std::f32::consts::PI + 1e-5);
        }
    }

    /// Analytic derivatives against differences of positions.
    #[test]
    fn derivatives_belong_to_positions(asked in arcs(0.05..0.3)) {
        let Ok(trajectory) = plan(&IRB_930, &two_kg(), &asked.from, asked.target(), 0.3) else { return Ok(()) };
        let h = 1e-3;
        for k in 1..50 {
            let t = h + (trajectory.duration() - 2.0 * h) * k as f32 / 50.0;
            let [before, here, after] = [t - h, t, t + h].map(|t| trajectory.at(&IRB_930, t).unwrap());
            let qd = (after.q - before.q) / (2.0 * h);
            let qdd = (after.qd - before.qd) / (2.0 * h);
            // As of a line in motion.rs.
            prop_assert!((qd - here.qd).amax() < 1e-2, "{qd} {}", here.qd);
            prop_assert!((qdd - here.qdd).amax() < 40_000.0 * h, "{qdd} {}", here.qdd);
        }
    }

    /// An arc of a circle of ten metres and more is a line but for its bow, in time as in space.
    #[test]
    fn a_flat_arc_is_nearly_a_line(x in 0.4f32..0.7, y in 0.1f32..0.3, bow in 0.0003f32..0.001, yaw in -1.0f32..1.0) {
        let [start, end] = [y, -y].map(|y| Pose { x, y, z: -0.2, yaw: 0.0 });
        let end = Pose { yaw, ..end };
        let from = kinematics::inverse(&IRB_930, &start, Elbow::Positive, &Vector4::zeros()).unwrap();
        let via = Vector3::new(x + bow, 0.0, -0.2);
        let plan = |target| plan(&IRB_930, &two_kg(), &from, target, 1.0);
        let (arc, line) = match (plan(Target::Arc(via, end, Posture::NEAREST)), plan(Target::Line(end, Posture::NEAREST))) {
            (Ok(arc), Ok(line)) => (arc, line),
            _ => return Ok(()),
        };
        for k in 0..=200 {
            let (on_arc, on_line) = (tool(&at(&arc, k, 200)), tool(&at(&line, k, 200)));
            let aside = on_arc.x - f64::from(x);
            prop_assert!((-2e-6..f64::from(bow) + 2e-6).contains(&aside), "{aside}");
            prop_assert!((on_line.x - f64::from(x)).abs() < 2e-6);
        }
        let ratio = arc.duration() / line.duration();
        prop_assert!((ratio - 1.0).abs() < 0.05, "{ratio}");
    }

    /// Whatever is asked for: the plan ends, with a trajectory or a refusal.
    #[test]
    fn any_points_are_answered(
        start in (0.3f32..1.0, -2.5f32..2.5), via in prop::array::uniform3(-100.0f32..100.0), near in any::<bool>(),
        end in prop::array::uniform3(-1.0f32..1.0), tool_speed in prop_oneof![Just(0.0f32), 1e-4f32..2.0],
    ) {
        let (r, a) = start;
        let pose = Pose { x: r * a.cos(), y: r * a.sin(), z: -0.25, yaw: 0.0 };
        let Ok(from) = kinematics::inverse(&IRB_930, &pose, Elbow::Positive, &Vector4::zeros()) else { return Ok(()) };
        let scale = if near { 1e-3 } else { 1.0 };
        let offset = |p: [f32; 3], scale: f32| Vector3::new(pose.x + p[0] * scale, pose.y + p[1] * scale, pose.z + p[2] * scale);
        let (via, end) = (offset(via, scale), offset(end, scale));
        let end = Pose { x: end.x, y: end.y, z: end.z, yaw: 0.3 };
        let asked_end = Point::new(end.x.into(), end.y.into(), end.z.into());
        let target = Target::Arc(via, end, Posture::NEAREST);
        if let Ok(trajectory) = plan_with(Planner::new(), &IRB_930, &two_kg(), &from, target, (1.0, tool_speed)) {
            prop_assert!(trajectory.duration().is_finite());
            prop_assert!((tool(&trajectory.end) - asked_end).amax() < 2e-6);
        }
    }
}
