//! Torques that swing, against the shares of a motor's limit that are worked out by hand here.

#![allow(
    clippy::expect_used,
    clippy::indexing_slicing,
    clippy::panic,
    clippy::unwrap_used,
    reason = "a test fails by panicking"
)]

use firmware::control::chatter::Chatter;
use firmware::mechanics::arm::Axis;
use nalgebra::Vector4;

const PERIOD: f32 = 1e-3;
/// N m; powers of two, so that shares of them are exact.
const LIMIT: Vector4<f32> = Vector4::new(8.0, 4.0, 2.0, 1.0);
/// In which a plan takes up the greatest torque, s.
const RISE: Vector4<f32> = Vector4::new(0.008, 0.016, 0.032, 0.064);

/// A torque of one axis, as a share of its limit.
fn of(axis: Axis, share: f32) -> Vector4<f32> {
    let mut torque = Vector4::zeros();
    *axis.of_mut(&mut torque) = share * axis.of(&LIMIT);
    torque
}

/// Looks at these torques of four samples again and again, of which the oldest is at any of the places that there are. Returns the
/// number of the look that finds something, and what that is.
fn look(
    torques: [Vector4<f32>; 4],
    place: usize,
    rise: &Vector4<f32>,
    period: f32,
) -> Option<(i32, Axis, f32)> {
    let mut chatter = Chatter::new();
    (0..place).for_each(|_| chatter.keep(&LIMIT));
    torques.iter().for_each(|torque| chatter.keep(torque));
    (1..=500).find_map(|number| {
        let (axis, percent) = chatter.look(&LIMIT, rise, period)?;
        Some((number, axis, percent))
    })
}

/// What a mean over ten looks has risen to after `looks` at the same `swing`, %.
fn risen(swing: f64, looks: i32) -> f64 {
    swing * (1.0 - 0.9f64.powi(looks))
}

/// The look at which it exceeds 80 %, and how far.
fn expected(swing: f64) -> Option<(i32, f64)> {
    let looks = (1..=500).find(|looks| risen(swing, *looks) > 80.0)?;
    Some((looks, risen(swing, looks)))
}

#[track_caller]
fn assert_found(found: Option<(i32, Axis, f32)>, swing: f64, axis: Axis) {
    let Some((looks, percent)) = expected(swing) else {
        assert_eq!(found, None);
        return;
    };
    let (number, of, value) = found.expect("it swings");
    assert_eq!((number, of), (looks, axis));
    // Roundings of each look.
    let error = (f64::from(value) - percent).abs();
    assert!(error <= 1e-5 * percent, "{value} {percent}");
}

/// By `a` to both sides in every other sample: 4 `a`, wherever the mean is, up to 200 % in one look.
#[test]
fn a_swing_of_every_sample_counts_four_times() {
    for axis in Axis::ALL {
        for place in 0..9 {
            for (a, swing) in [
                (0.199, 79.6),
                (0.25, 100.0),
                (0.375, 150.0),
                (0.5, 200.0),
                (1.0, 200.0),
            ] {
                for (mean, sign) in [(0.0, 1.0), (0.5, -1.0), (-0.25, 1.0)] {
                    let torques =
                        [a, -a, a, -a].map(|a| LIMIT * (0.5 * mean) + of(axis, mean + sign * a));
                    assert_found(look(torques, place, &RISE, PERIOD), swing, axis);
                }
            }
        }
    }
}

/// And one of four samples, which is at its mean in two of them, counts twice, whichever of them comes first.
#[test]
fn a_swing_of_four_samples_counts_twice() {
    for place in 0..4 {
        for first in 0..4 {
            let a = |k: usize| [0.5, 0.0, -0.5, 0.0][(first + k) % 4];
            let torques = [0, 1, 2, 3].map(|k| of(Axis::Lift, a(k)));
            assert_found(look(torques, place, &RISE, PERIOD), 100.0, Axis::Lift);
        }
    }
}

/// Shares of all the motors count; the one that has the most is named.
#[test]
fn swings_are_summed_over_the_motors() {
    let torques = [1.0f32, -1.0, 1.0, -1.0]
        .map(|sign| of(Axis::Shoulder, 0.1 * sign) + of(Axis::Wrist, -0.15 * sign));
    assert_found(look(torques, 0, &RISE, PERIOD), 100.0, Axis::Wrist);
}

/// In a period of more than a millisecond the same swing counts less, in proportion; in a shorter one not more.
#[test]
fn a_longer_period_allows_more() {
    for (period, swing) in [
        (0.25e-3, 180.0),
        (1e-3, 180.0),
        (2e-3, 90.0),
        (2.5e-3, 72.0),
    ] {
        let torques = [0.45f32, -0.45, 0.45, -0.45].map(|a| of(Axis::Elbow, a));
        assert_found(look(torques, 1, &RISE, period), swing, Axis::Elbow);
    }
}

/// A torque that for long changes faster than any plan, as in a slow swing: 80 % is what a plan does at the most, and twice that the
/// most that one look counts. What changes evenly has no swing, in whatever order the samples are kept.
#[test]
fn a_torque_that_keeps_changing_is_judged_by_what_a_plan_can_do() {
    for axis in Axis::ALL {
        for place in 0..9 {
            for (rate, swing) in [(0.99f32, 79.2), (1.25, 100.0), (5.0, 160.0)] {
                for (sign, period) in [(1.0, 1e-3), (-1.0, 0.5e-3), (1.0, 2e-3)] {
                    // From none to the greatest torque in `rise`.
                    let step = sign * rate * period / axis.of(&RISE);
                    let torques = [0.0, 1.0, 2.0, 3.0].map(|k| of(axis, 0.125 + k * step));
                    let found = look(torques, place, &RISE, period);
                    let Some((looks, percent)) = expected(swing) else {
                        assert_eq!(found, None, "{axis:?} {rate}");
                        continue;
                    };
                    let (number, of, value) = found.expect("it is steep");
                    assert_eq!((number, of), (looks, axis));
                    // The difference of torques of some shares of the limit.
                    let error = (f64::from(value) - percent).abs();
                    assert!(error <= 1e-3 * percent, "{value} {percent}");
                }
            }
        }
    }
}

/// The last torque, and the last four, after any number of samples.
#[test]
fn four_samples_are_kept() {
    let torque = |k: u16| of(Axis::Elbow, f32::from(k) / 1024.0);
    let mut chatter = Chatter::new();
    for k in 1..100 {
        chatter.keep(&torque(k));
        assert_eq!(chatter.last(), torque(k));
        for old in 0..4u16 {
            assert!(chatter.torques().contains(&torque(k.saturating_sub(old))));
        }
    }
}

/// Torques of an axis that are cut to one side and then to the other for `held` samples each, `apart` samples between two cuts. Returns
/// how many sides it was cut to when that was found out.
fn swing(chatter: &mut Chatter, axis: Axis, rise: f32, sides: u32, apart: u16) -> Option<u32> {
    let rises = Vector4::repeat(rise);
    for side in 1..=sides {
        let excess = of(axis, if side % 2 == 0 { 0.25 } else { -0.25 });
        for sample in 0..apart + 2 {
            let cut = if sample < 3 { excess } else { Vector4::zeros() };
            let found = chatter.cut(&cut, &rises);
            chatter.keep(&LIMIT);
            if found.is_some() {
                assert_eq!(found, Some(axis));
                return Some(side);
            }
        }
    }
    None
}

/// From limit to limit a plan takes twice its rise; five turns in less are a swing.
#[test]
fn torques_that_are_cut_to_both_sides_are_a_swing() {
    for axis in Axis::ALL {
        for (rise, apart, found) in [
            (5.0, 9, Some(6)),
            (5.0, 10, None),
            (5.1, 10, Some(6)),
            (20.0, 39, Some(6)),
            (20.0, 40, None),
            (0.9, 2, None),
        ] {
            let mut chatter = Chatter::new();
            (0..100).for_each(|_| chatter.keep(&LIMIT));
            let sides = swing(&mut chatter, axis, rise, 40, apart);
            assert_eq!(sides, found, "{axis:?} {rise} {apart}");
        }
    }
}

/// Three turns and a slow one, and again: never five in a row. Nor is one that is cut to one side only.
#[test]
fn a_slow_turn_ends_a_row_of_quick_ones() {
    let mut chatter = Chatter::new();
    for _ in 0..20 {
        (0..100).for_each(|_| chatter.keep(&LIMIT));
        assert_eq!(swing(&mut chatter, Axis::Lift, 5.0, 4, 8), None);
    }
    let mut chatter = Chatter::new();
    for _ in 0..100 {
        let excess = of(Axis::Lift, 0.5);
        assert_eq!(chatter.cut(&excess, &Vector4::repeat(5.0)), None);
        chatter.keep(&LIMIT);
    }
}
