//! Which gains are accepted, against the sampled loop itself: a joint with inertia 1, a torque that is held over a
//! sample and acts late, a velocity that is a mean, and the observer as its difference equations.

#![allow(
    clippy::expect_used,
    clippy::indexing_slicing,
    clippy::panic,
    clippy::unwrap_used,
    reason = "a test fails by panicking"
)]

#[path = "common/draws.rs"]
mod draws;

use firmware::control::laws::{Gains, Selection};
use firmware::mechanics::arm::{Axis, IRB_930, Payload};
use nalgebra::{SMatrix, SVector};
use proptest::prelude::*;
use protocol::messages::{Compensation, Law, RefusalReason};

/// Position, velocity, position before, three torques before (the latest first), mean torque before, and two numbers of
/// the compensation: its integral or expected momentum, and its residual.
type State = SVector<f64, 9>;

struct Loop {
    selection: Selection,
    period: f64,
    delay: f64,
    /// Inertia of the model over that of the joint.
    gain: f64,
}

impl Loop {
    fn step(&self, state: &State) -> State {
        let [p, v, before, u1, u2, u3, mean_before, kept, residual] = (*state).into();
        let Gains {
            bandwidth,
            damping,
            observer,
        } = self.selection.gains;
        let [w, zeta, corner] = [bandwidth, damping, observer].map(f64::from);
        let (t, d) = (self.period, self.delay);
        let velocity = (p - before) / t;
        // What acted over the last sample, in parts.
        let late = (d / t).fract() * t;
        let (earlier, later) = if d < t { (u2, u1) } else { (u3, u2) };
        let mean = (late * earlier + (t - late) * later) / t;
        let pull = -(w * w * p + 2.0 * zeta * w * velocity);
        let (u, kept, residual) = match self.selection.compensation {
            Compensation::None => (pull, 0.0, 0.0),
            Compensation::Integral => {
                let sum = kept + p * t;
                (pull - w * w * corner * sum, sum, 0.0)
            }
            Compensation::Observer => {
                let expected = kept + (0.5 * (mean + mean_before) + residual) * t;
                let residual = corner.min(0.5 / t) * (velocity - expected);
                (pull - residual, expected, residual)
            }
        };
        let (earlier, later) = if d < t { (u1, u) } else { (u2, u1) };
        let (mut position, mut speed) = (p, v);
        for (time, torque) in [(late, earlier), (t - late, later)] {
            let a = self.gain * torque;
            position += speed * time + 0.5 * a * time * time;
            speed += a * time;
        }
        State::from([position, speed, p, u, u1, u2, mean, kept, residual])
    }

    fn is_stable(&self) -> bool {
        let columns: Vec<State> = (0..9)
            .map(|column| self.step(&State::ith(column, 1.0)))
            .collect();
        // Powers of the matrix: 2^30 samples later what is stable has vanished.
        let mut matrix = SMatrix::<f64, 9, 9>::from_columns(&columns);
        for _ in 0..30 {
            matrix = matrix * matrix;
            let greatest = matrix.amax();
            if !(1e-100..1e100).contains(&greatest) {
                return greatest < 1.0;
            }
        }
        false
    }
}

fn law(compensation: Compensation, gains: Gains) -> Selection {
    Selection {
        law: Law::ComputedTorqueJoint,
        compensation,
        gains,
    }
}

fn compensations() -> impl Strategy<Value = Compensation> {
    prop::sample::select(Compensation::ALL)
}

proptest! {
    #![proptest_config(draws::cases(3000))]

    /// What is accepted is stable, and unless it is hardly damped stays so when the joint has two thirds of the model's inertia or
    /// one and a half times as much.
    #[test]
    fn accepted_gains_have_a_margin(
        rate in 100.0f64..10_000.0, delay in 0.02f64..1.9, compensation in compensations(),
        bandwidth in 0.002f32..0.25, damping in 0.1f32..5.0, observer in 0.002f32..0.25,
    ) {
        let period = 1.0 / rate;
        let [bandwidth, observer] = [bandwidth, observer].map(|corner| corner * rate as f32);
        let selection = law(compensation, Gains { bandwidth, damping, observer });
        let delay = delay * period;
        if selection.check(period as f32, delay as f32).is_err() {
            return Ok(());
        }
        let gains: &[f64] = if damping < 0.3 { &[1.0] } else { &[1.0 / 1.5, 1.0, 1.5] };
        for &gain in gains {
            let sampled = Loop { selection, period, delay, gain };
            prop_assert!(sampled.is_stable(), "unstable with {gain} times the gain");
        }
    }

    /// The bound is no more careful than it has to be: with three times the bandwidth that is refused for the delay the loop is
    /// unstable, or the gain margin is below three.
    #[test]
    fn the_bound_is_near_the_edge(
        rate in 100.0f64..4000.0, delay in 0.02f64..1.0, damping in 0.7f32..5.0,
    ) {
        let period = 1.0 / rate;
        let delay = delay * period;
        let ask = |bandwidth| {
            law(Compensation::None, Gains { bandwidth, damping, observer: 1.0 })
        };
        let Err(refusal) = ask(0.24 * rate as f32).check(period as f32, delay as f32) else { return Ok(()) };
        prop_assert_eq!(refusal.reason, RefusalReason::OutOfRange);
        prop_assert!(ask(refusal.limit).check(period as f32, delay as f32).is_ok());
        let sampled = Loop { selection: ask(refusal.limit), period, delay, gain: 3.0 };
        prop_assert!(!sampled.is_stable());
    }
}

/// The defaults are accepted at every rate.
#[test]
fn defaults_are_accepted() {
    for rate in 100..=10_000u16 {
        let period = 1.0 / f32::from(rate);
        for compensation in Compensation::ALL {
            let selection = law(*compensation, Gains::for_period(period));
            assert_eq!(selection.check(period, 249.6e-6), Ok(()), "{rate} Hz");
        }
    }
}

/// Gains that once made an arm chatter at rest with 484 N m.
#[test]
fn a_chattering_loop_is_refused() {
    let gains = Gains {
        bandwidth: 150.0,
        damping: 5.0,
        observer: 100.0,
    };
    let refusal = law(Compensation::Observer, gains)
        .check(1e-3, 249.6e-6)
        .unwrap_err();
    assert_eq!(
        (refusal.reason, refusal.value),
        (RefusalReason::OutOfRange, 150.0)
    );
    // (pi/2 - 1/100) / 2 of phase at 10.01 times the bandwidth, over 1.2496 ms.
    assert!((refusal.limit - 62.4).abs() < 0.1, "{}", refusal.limit);
}

/// A slow loop that integrates fast is unstable without any delay.
#[test]
fn an_integral_faster_than_its_loop_is_refused() {
    let gains = Gains {
        bandwidth: 20.0,
        damping: 0.5,
        observer: 30.0,
    };
    let integral = law(Compensation::Integral, gains);
    let refusal = integral.check(1e-3, 249.6e-6).unwrap_err();
    assert_eq!((refusal.value, refusal.limit), (30.0, 10.0));
    let sampled = Loop {
        selection: integral,
        period: 1e-3,
        delay: 249.6e-6,
        gain: 1.0,
    };
    assert!(!sampled.is_stable());
    assert_eq!(
        law(Compensation::Observer, gains).check(1e-3, 249.6e-6),
        Ok(())
    );
}

/// A count of the shoulder's encoder in torque, by hand for the stretched arm with 22 kg: 38.92 kg m², of which the payload has 24.26, the
/// second arm 8.88 and the rotor 2.46.
#[test]
fn coarse_encoders_lower_the_gains() {
    let period = 5e-4;
    let usual = Gains::for_period(period);
    let heaviest = Payload {
        mass: 22.0,
        ..Payload::NONE
    };
    assert_eq!(Gains::for_arm(&IRB_930, period), usual);
    let share = |counts: f64| {
        let count = std::f64::consts::TAU / counts / 80.0;
        38.92 * (2.0 * 190.0 + 190.0) * count / 5e-4 / 640.0
    };
    let (axis, found) = usual.encoder_step(&IRB_930, &heaviest, period);
    assert_eq!(axis, Axis::Shoulder);
    assert!((f64::from(found) / share(131_072.0) - 1.0).abs() < 1e-3);
    let with = |counts| {
        let mut arm = IRB_930;
        arm.drive.encoder_counts = counts;
        Gains::for_arm(&arm, period)
    };
    // 4.15 % with 131,072 counts: a tenth of the limit with 54,450.
    assert_eq!(with(54_600), usual);
    for counts in [54_300, 20_000, 10_000, 4096, 1000] {
        let gains = with(counts);
        let wanted = 190.0 * 0.1 / share(f64::from(counts));
        for gain in [gains.bandwidth, gains.observer] {
            assert!(
                (f64::from(gain) / wanted - 1.0).abs() < 1e-3,
                "{counts}: {gain} {wanted}"
            );
        }
        assert_eq!(gains.damping, usual.damping);
        // As slow as they are, every law takes them.
        let integral = law(Compensation::Integral, gains);
        assert_eq!(integral.check(period, 249.6e-6), Ok(()));
    }
    // None is lowered below its range.
    assert_eq!(with(16).bandwidth, 1.0);
}

/// A count of the wrist's encoder with 22 kg 0.4 m off the axis of the flange, by hand: 3.52 kg m2, beside which the rest of the wrist is
/// nothing.
#[test]
fn loads_off_the_flange_lower_the_gains_for_the_wrist() {
    let period = 5e-4;
    let usual = Gains::for_period(period);
    let load = Payload {
        mass: 22.0,
        com: nalgebra::Vector3::new(0.4, 0.0, 0.0),
        ..Payload::NONE
    };
    let drive = &IRB_930.drive;
    let count =
        std::f64::consts::TAU / f64::from(drive.encoder_counts) / f64::from(drive.gear_ratio.w);
    let limit = f64::from(IRB_930.limits.effort.w);
    let share = 22.0 * 0.4 * 0.4 * (3.0 * f64::from(usual.bandwidth)) * count / 5e-4 / limit;
    let (axis, found) = usual.encoder_step(&IRB_930, &load, period);
    assert_eq!(axis, Axis::Wrist);
    assert!(
        (f64::from(found) / share - 1.0).abs() < 0.03,
        "{found} {share}"
    );
    let gains = Gains::for_load(&IRB_930, &load, period);
    let lowered = f64::from(usual.bandwidth * Gains::ENCODER_STEP / found);
    assert!((f64::from(gains.bandwidth) / lowered - 1.0).abs() < 1e-3);
}
