//! The rows.

use super::{Default, Kind, Parameter, Rule, Settable};

/// Declares the parameters of a server: `Variant = number, "name", "unit", when settable, range;`, each under one line
/// of documentation, which is also its description at run time.
macro_rules! parameters {
    (
        $(#[$meta:meta])*
        pub enum $list:ident {
            $(#[doc = $doc:literal] $variant:ident = $number:literal, $name:literal, $unit:literal, $settable:ident, $range:expr;)+
        }
    ) => {
        $(#[$meta])*
        #[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
        pub enum $list { $(#[doc = $doc] $variant,)+ }

        impl $list {
            /// Every parameter, by number.
            pub const ALL: &'static [Self] = &[$(Self::$variant,)+];
            /// Rows for people, in the order of `ALL`.
            pub const TABLE: &'static [Parameter] = &[$(Self::$variant.parameter(),)+];

            /// The row.
            #[must_use]
            pub const fn parameter(self) -> Parameter {
                match self {
                    $(Self::$variant => $range.parameter(
                        $number, $name, $unit, Settable::$settable, $doc.trim_ascii_start(),
                    ),)+
                }
            }

            /// Numbers and ranges, in the order of `ALL`. Kept apart from names and units, which an image does not
            /// need.
            pub const RULES: &'static [Rule] = &[$(Self::$variant.rule(),)+];

            /// Number, range, and when it may be written.
            #[must_use]
            pub const fn rule(self) -> Rule {
                self.parameter().rule
            }

            /// Value at the start for a sampling period (s); for a reading the least it can be.
            #[must_use]
            pub const fn initial(self, period: f32) -> f32 {
                match self.parameter().default {
                    Some(default) => default.at(period),
                    None => self.rule().lower,
                }
            }
        }
    };
}

parameters! {
    /// Parameters of the controller. Axes are shoulder, elbow, lift, wrist.
    pub enum ControllerParameter {
        /// Sampling period that the controller is built for.
        SamplingPeriod = 0x0000, "sampling-period", "s", Never, reading(1e-4, 1e-2);
        /// Payload mass that the control law uses, as set by set-payload.
        PayloadMass = 0x0001, "payload-mass", "kg", Never, reading(0.0, 100.0);
        /// Natural frequency of the error dynamics.
        Bandwidth = 0x0010, "bandwidth", "rad/s", AtRest, corner(1.0, 1000.0, (190.0, 0.17));
        /// Damping ratio of the error dynamics.
        Damping = 0x0011, "damping", "", AtRest, real(0.1, 5.0, 1.0);
        /// Corner frequency of the disturbance observer, or 1 / integral time.
        Observer = 0x0012, "observer", "rad/s", AtRest, corner(0.1, 1000.0, (190.0, 0.17));
        /// Time from a sample until its command acts: two frames at the default bit timing, and the computing time.
        CommandDelay = 0x0013, "command-delay", "s", AtRest, real(0.0, 5e-3, 249.6e-6);
        /// Following error of the shoulder that stops the arm.
        FollowingErrorShoulder = 0x0020, "following-error-shoulder", "rad", Always, real(0.001, 0.5, 0.05);
        /// Following error of the elbow that stops the arm.
        FollowingErrorElbow = 0x0021, "following-error-elbow", "rad", Always, real(0.001, 0.5, 0.05);
        /// Following error of the lift that stops the arm.
        FollowingErrorLift = 0x0022, "following-error-lift", "m", Always, real(0.0002, 0.05, 0.01);
        /// Following error of the wrist that stops the arm.
        FollowingErrorWrist = 0x0023, "following-error-wrist", "rad", Always, real(0.004, 1.0, 0.2);
        /// How far past its range the shoulder may go before the arm is stopped.
        RangeMarginShoulder = 0x0024, "range-margin-shoulder", "rad", Always, real(0.0, 0.1, 0.02);
        /// How far past its range the elbow may go before the arm is stopped.
        RangeMarginElbow = 0x0025, "range-margin-elbow", "rad", Always, real(0.0, 0.1, 0.02);
        /// How far past its range the lift may go before the arm is stopped.
        RangeMarginLift = 0x0026, "range-margin-lift", "m", Always, real(0.0, 0.01, 0.002);
        /// How far past its range the wrist may go before the arm is stopped.
        RangeMarginWrist = 0x0027, "range-margin-wrist", "rad", Always, real(0.0, 0.2, 0.05);
        /// Speed that stops the arm, as a multiple of the joint's speed limit.
        SpeedFactor = 0x0028, "speed-factor", "", Always, real(0.05, 1.5, 1.1);
        /// Samples in a row beyond a limit before the arm is stopped.
        FaultSamples = 0x0029, "fault-samples", "samples", Always, whole(1.0, 20.0, 3.0);
        /// Effort that the model does not explain and that stops the arm, as a share of the joint's limit.
        CollisionLimit = 0x002A, "collision-limit", "", Always, real(0.05, 10.0, 0.5);
        /// Time allowed for the brake to open or close; the brake of the lift needs 50 ms.
        BrakeDelay = 0x0030, "brake-delay", "s", AtRest, real(0.05, 1.0, 0.06);
        /// Age of the feedback at which the drives count as silent: torque off, brake.
        FeedbackTimeout = 0x0031, "feedback-timeout", "s", Always, real(0.02, 1.0, 0.1);
        /// Longest gap in the feedback across which the trajectory continues.
        FeedbackGap = 0x0032, "feedback-gap", "s", Always, real(0.001, 0.02, 0.005);
        /// Rejected, stale or duplicate feedback frames in a row that stop the arm.
        BadFrames = 0x0033, "bad-frames", "frames", Always, whole(1.0, 20.0, 3.0);
        /// Time in one move at a torque limit of an axis that hardly moves that stops the arm.
        SaturationTime = 0x0034, "saturation-time", "s", Always, real(0.02, 10.0, 0.2);
        /// Time without a heartbeat after which a node whose heartbeat was heard counts as silent.
        HeartbeatTimeout = 0x0035, "heartbeat-timeout", "s", Always, real(0.12, 5.0, 0.25);
        /// Time for which one hold lets moves go on in manual operation.
        HoldTime = 0x0036, "hold-time", "s", AtRest, real(0.05, 0.5, 0.15);
        /// Time constant with which a motor warms up and cools down.
        ThermalTime = 0x0037, "thermal-time", "s", Always, real(1.0, 3600.0, 30.0);
    }
}

parameters! {
    /// Parameters of the drives. Axes are shoulder, elbow, lift, wrist.
    pub enum DriveParameter {
        /// Rated torque of the shoulder's motor, the scale of its feedback.
        RatedTorqueShoulder = 0x1000, "rated-torque-shoulder", "N m", Never, reading(0.0, 200.0);
        /// Rated torque of the elbow's motor, the scale of its feedback.
        RatedTorqueElbow = 0x1001, "rated-torque-elbow", "N m", Never, reading(0.0, 200.0);
        /// Rated torque of the lift's motor, the scale of its feedback.
        RatedTorqueLift = 0x1002, "rated-torque-lift", "N m", Never, reading(0.0, 200.0);
        /// Rated torque of the wrist's motor, the scale of its feedback.
        RatedTorqueWrist = 0x1003, "rated-torque-wrist", "N m", Never, reading(0.0, 200.0);
        /// Fraction of its peak torque that the shoulder's motor may give.
        TorqueLimitShoulder = 0x1010, "torque-limit-shoulder", "", AtRest, real(0.1, 1.0, 1.0);
        /// Fraction of its peak torque that the elbow's motor may give.
        TorqueLimitElbow = 0x1011, "torque-limit-elbow", "", AtRest, real(0.1, 1.0, 1.0);
        /// Fraction of its peak torque that the lift's motor may give.
        TorqueLimitLift = 0x1012, "torque-limit-lift", "", AtRest, real(0.1, 1.0, 1.0);
        /// Fraction of its peak torque that the wrist's motor may give.
        TorqueLimitWrist = 0x1013, "torque-limit-wrist", "", AtRest, real(0.1, 1.0, 1.0);
        /// Samples for which the last command is held without a new one; then brake and torque off.
        HoldSamples = 0x1020, "hold-samples", "samples", Always, samples(1.0, 50.0, (5.0, 5e-3));
    }
}

/// Values that a parameter can have.
struct Range {
    kind: Kind,
    lower: f32,
    upper: f32,
    default: Option<Default>,
}

const fn real(lower: f32, upper: f32, default: f32) -> Range {
    Range {
        kind: Kind::Real,
        lower,
        upper,
        default: Some(Default {
            most: default,
            per_sample: f32::INFINITY,
            lasts: 0.0,
        }),
    }
}

const fn whole(lower: f32, upper: f32, default: f32) -> Range {
    Range {
        kind: Kind::Whole,
        ..real(lower, upper, default)
    }
}

/// The default is a number, and the time in s that they last at least.
const fn samples(lower: f32, upper: f32, (number, lasts): (f32, f32)) -> Range {
    Range {
        default: Some(Default {
            most: number,
            per_sample: f32::INFINITY,
            lasts,
        }),
        ..whole(lower, upper, number)
    }
}

const fn reading(lower: f32, upper: f32) -> Range {
    Range {
        default: None,
        ..real(lower, upper, lower)
    }
}

/// The default is a value and a limit in rad per sample.
const fn corner(lower: f32, upper: f32, (most, per_sample): (f32, f32)) -> Range {
    Range {
        kind: Kind::Corner,
        lower,
        upper,
        default: Some(Default {
            most,
            per_sample,
            lasts: 0.0,
        }),
    }
}

impl Range {
    const fn parameter(
        self,
        number: u16,
        name: &'static str,
        unit: &'static str,
        settable: Settable,
        about: &'static str,
    ) -> Parameter {
        Parameter {
            rule: Rule {
                number,
                settable,
                kind: self.kind,
                lower: self.lower,
                upper: self.upper,
            },
            name,
            unit,
            about,
            default: self.default,
        }
    }
}
