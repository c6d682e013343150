//! Profiles against integration, bounds and the textbook.

use super::*;
use proptest::prelude::*;

fn even(speed: f32, accelerate: f32, brake: f32, jerk: f32) -> Bounds {
    Bounds {
        speed,
        jerk,
        accelerate: HalfBounds::even(accelerate, jerk),
        brake: HalfBounds::even(brake, jerk),
    }
}

/// Accelerations in the order of time: from rest, to the peak speed, from it, to rest; jerks from rest, at the peak speed, to rest.
fn uneven(speed: f32, accelerations: [f32; 4], jerks: [f32; 3]) -> Bounds {
    let [slow, fast, late, last] = accelerations;
    let [from_rest, peak, to_rest] = jerks;
    Bounds {
        speed,
        jerk: peak,
        accelerate: HalfBounds {
            jerk: from_rest,
            slow,
            fast,
        },
        brake: HalfBounds {
            jerk: to_rest,
            slow: last,
            fast: late,
        },
    }
}

proptest! {
    /// The three derivatives, integrated in f64, reproduce the distance; no bound is exceeded.
    #[test]
    fn integrates_to_the_distance_within_bounds(
        distance in 0.01f32..6.0,
        speed in 0.05f32..30.0,
        accelerations in prop::array::uniform4(0.2f32..1.0),
        most in 2.0f32..600.0,
        jerks in prop::array::uniform3(0.3f32..1.0),
        jerk in 100.0f32..40_000.0,
    ) {
        let [slow, fast, late, last] = accelerations.map(|share| share * most);
        let [from_rest, peak, to_rest] = jerks.map(|share| share * jerk);
        let bounds = uneven(speed, [slow, fast, late, last], [from_rest, peak, to_rest]);
        let curve = SCurve::new(distance, &bounds);
        let duration = curve.duration();
        let steps = 4000;
        let h = f64::from(duration) / f64::from(steps);
        let mut s = 0.0f64;
        let mut before = 0.0;
        for i in 0..steps {
            let sample = curve.at(((f64::from(i) + 0.5) * h) as f32);
            s += f64::from(sample.v) * h;
            prop_assert!(sample.v >= -1e-5 && sample.v <= speed * 1.00001);
            prop_assert!(sample.a <= slow.max(fast) * 1.00001);
            prop_assert!(-sample.a <= late.max(last) * 1.00001);
            // Accelerations of f32, each off by 4 u, at times of f32.
            let noise = 8.0 * f32::EPSILON * most + 2.0 * f32::EPSILON * duration * jerk;
            let allowed = from_rest.max(peak).max(to_rest) * (h as f32) * 1.0001;
            prop_assert!((sample.a - before).abs() <= allowed + noise);
            before = sample.a;
        }
        // Midpoint rule: error below h^2/24 * T * max|a'| = jerk; plus f32 in the evaluation.
        let rule = h * h * f64::from(duration * jerk) / 24.0;
        prop_assert!((s - f64::from(distance)).abs() < rule + 4e-6 * f64::from(distance), "{s} {distance}");
        prop_assert_eq!(curve.at(duration).s, distance);
        prop_assert_eq!(curve.at(-1.0), Sample::default());
    }

    /// It passes a place at the time that it tells, whatever it is bounded by.
    #[test]
    fn time_at_inverts_any_profile(
        distance in 0.01f32..3.0,
        speed in 0.5f32..30.0,
        accelerations in prop::array::uniform4(0.2f32..1.0),
        jerks in prop::array::uniform3(0.3f32..1.0),
        share in 0.001f32..1.0,
    ) {
        let bounds = uneven(speed, accelerations.map(|share| share * 300.0), jerks.map(|share| share * 20_000.0));
        let curve = SCurve::new(distance, &bounds);
        let s = share * distance;
        let here = curve.at(curve.time_at(s));
        // 8 u of the time at its speed, and of the place.
        let slack = 8.0 * f32::EPSILON * (curve.duration() * here.v + distance);
        prop_assert!((here.s - s).abs() <= slack, "{} {s}", here.s);
    }

    /// Both halves and what is between them make up the distance: the motion does not jump in its middle, however little
    /// acceleration there is for the jerk.
    #[test]
    fn the_halves_meet(
        distance in 1e-5f32..6.0,
        speed in 0.01f32..30.0,
        accelerations in prop::array::uniform4(0.2f32..1.0),
        most in -4.0f32..3.0,
        jerks in prop::array::uniform3(0.4f32..1.0),
        jerk in 1.0f32..6.0,
    ) {
        let bounds = uneven(speed, accelerations.map(|share| share * libm::powf(10.0, most)), jerks.map(|share| share * libm::powf(10.0, jerk)));
        let curve = SCurve::new(distance, &bounds);
        let SCurve { accelerate, brake, cruise, peak, .. } = curve;
        let sum = accelerate.distance + brake.distance + cruise * peak.speed;
        prop_assert!((sum - distance).abs() <= 4e-6 * distance, "{sum} of {distance}");
    }

    /// Position is continuous across the segment borders: no jump larger than speed x step.
    #[test]
    fn is_continuous(
        distance in 0.01f32..6.0,
        accelerate in 0.5f32..600.0,
        jerk in 50.0f32..40_000.0,
    ) {
        let bounds = even(1e3, accelerate, accelerate, jerk);
        let curve = SCurve::new(distance, &bounds);
        let h = curve.duration() / 1000.0;
        for i in 0..1000 {
            let (before, after) = (curve.at(i as f32 * h), curve.at((i + 1) as f32 * h));
            let slack = 4e-6 * distance;
            prop_assert!((after.s - before.s - 0.5 * (before.v + after.v) * h).abs()
                <= slack + jerk * h * h * h);
        }
    }
}

/// The jerk is constant between borders, and changes at each but those within the ramps next to the peak speed. All are found, and no other.
#[test]
fn borders_are_where_the_jerk_changes() {
    let bounds = even(2.0, 20.0, 30.0, 1e3);
    let curve = SCurve::new(1.0, &bounds);
    let mut t = -0.1;
    let borders = [(); 12].map(|()| {
        let border = curve.border_after(t);
        t = border + 1e-6;
        border
    });
    assert_eq!(curve.border_after(t), f32::INFINITY);
    assert_eq!(borders[0], 0.0);
    assert!((borders[11] / curve.duration() - 1.0).abs() < 1e-6);
    let jerks = [1e3, 0.0, -1e3, -1e3, -1e3, 0.0, -1e3, -1e3, -1e3, 0.0, 1e3];
    for ramp in [&borders[2..6], &borders[6..10]] {
        let third = (ramp[3] - ramp[0]) / 3.0;
        let mut parts = ramp.windows(2).map(|part| part[1] - part[0]);
        assert!(parts.all(|part| (part / third - 1.0).abs() < 1e-4));
    }
    for (segment, jerk) in borders.windows(2).zip(jerks) {
        let length = segment[1] - segment[0];
        for share in [0.01, 0.4, 0.7] {
            let t = segment[0] + share * length;
            let change = curve.at(t + 0.29 * length).a - curve.at(t).a;
            // Time and acceleration off by 4 u each, over 0.29 of some 10 ms.
            let slope = change / (0.29 * length);
            assert!((slope - jerk).abs() < 1.0, "{slope} {jerk} {borders:?}");
        }
    }
}

#[test]
fn symmetric_triangle_has_the_textbook_duration() {
    // Without a speed limit and with jerk only: T = (32 s / j)^(1/3).
    let curve = SCurve::new(1.0, &even(1e3, 1e6, 1e6, 500.0));
    let expected = libm::cbrtf(32.0 / 500.0);
    assert!((curve.duration() / expected - 1.0).abs() < 1e-6);
}

#[test]
fn time_at_inverts_the_profile() {
    let curve = SCurve::new(0.025, &even(2.2, 55.0, 40.0, 1e4));
    for i in 1..10 {
        let s = 0.0025 * i as f32;
        // At the peak speed of 1 m/s, 2^-14 of 50 ms.
        assert!((curve.at(curve.time_at(s)).s - s).abs() < 4e-6);
    }
}
