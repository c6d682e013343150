//! The observer that measures the run of a gate.

use std::io;

use nalgebra::Vector4;
use sim::metrics::Offset;
use sim::model::{Payload, RobotModel};
use sim::observer::{Observer, Truth};
use sim::plant::arm::Arm;
use sim::plant::drive::Drive;
use sim::scenario::PayloadSpec;
use sim::summary::Summary;
use sim::world::CellEvent;

use super::Figures;
use super::load::Load;

/// Offsets within which the tool has arrived, from coarse to fine.
const RADII: [Offset; 3] = [
    Offset::new(1e-3, 1e-2),
    Offset::new(1e-4, 1e-3),
    Offset::new(1e-5, 1e-4),
];

/// A gate as a run passes it, there and back.
#[derive(Clone, Copy, Debug)]
pub(super) struct Course {
    /// Both ends: x, y, z (m), yaw (rad).
    pub(super) ends: [[f64; 4]; 2],
    /// Height up to which it goes at least, m.
    pub(super) top: f64,
    /// Control rate, Hz.
    pub(super) rate_hz: f64,
    /// What the arm truly carries.
    pub(super) payload: Option<PayloadSpec>,
    /// Round trips.
    pub(super) cycles: u32,
}

/// Measures a run, sample by sample.
pub(super) struct Watch {
    robot: RobotModel,
    /// The arm with what it truly carries.
    arm: Arm,
    drive: Drive,
    period: f64,
    course: Course,
    /// Whether a cycle is under way.
    on: bool,
    /// Time of the last sample, and its efforts without dry friction.
    before: Option<(f64, [f64; 4])>,
    way: Option<Way>,
    /// Ways so far.
    ways: usize,
    sums: Sums,
    load: Load,
    /// Greatest change of an effort over what the model allows.
    rate_share: f64,
}

/// From one end of the stroke to the other, and the rest there.
#[derive(Clone, Copy)]
struct Way {
    from: [f64; 4],
    to: [f64; 4],
    started: f64,
    /// First sample at which the reference is at rest again.
    ended: Option<f64>,
    /// First sample since which the tool has stayed within each of [`RADII`].
    since: [Option<f64>; RADII.len()],
}

/// Over all ways.
#[derive(Default)]
struct Sums {
    planned: f64,
    /// Until within each of [`RADII`]; `None` once a way does not arrive.
    arrived: Option<[Option<f64>; RADII.len()]>,
    settling: Option<f64>,
    overshoot: f64,
    margin: Option<f64>,
}

impl Watch {
    /// For a run of `course` on `robot`, which is as it is and not as believed.
    pub(super) fn new(course: Course, robot: &RobotModel) -> Self {
        let payload = course.payload.map(Payload::from);
        Self {
            arm: Arm::new(robot, payload.as_ref()),
            drive: Drive::new(&robot.drive),
            robot: robot.clone(),
            period: 1.0 / course.rate_hz,
            course,
            on: false,
            before: None,
            way: None,
            ways: 0,
            sums: Sums::default(),
            load: Load::default(),
            rate_share: 0.0,
        }
    }

    /// What it comes to; `summary` has the rest.
    pub(super) fn figures(&self, optimum: f64, summary: &Summary) -> Figures {
        let greatest = |of_axes: [f64; 4]| of_axes.into_iter().fold(0.0, f64::max);
        let cycles = f64::from(self.course.cycles);
        let planned = self.sums.planned / cycles;
        let arrived = self.sums.arrived.unwrap_or_default();
        let [to_1, to_0_1, to_0_01] = arrived.map(|sum| sum.map(|sum| sum / cycles));
        let ratio = |time: Option<f64>| time.map(|time| time / optimum);
        let ratings = &self.robot.limits.effort_continuous;
        let speed = self.load.continuous_speed(ratings);
        Figures {
            planned_s: Some(planned),
            to_1_mm_s: to_1,
            to_0_1_mm_s: to_0_1,
            to_0_01_mm_s: to_0_01,
            planned_ratio: ratio(Some(planned)),
            to_1_mm_ratio: ratio(to_1),
            to_0_1_mm_ratio: ratio(to_0_1),
            to_0_01_mm_ratio: ratio(to_0_01),
            tracking_max_mm: Some(summary.tracking_error_mm.max),
            tracking_rms_mm: Some(summary.tracking_error_mm.rms),
            settling_ms: to_0_01.and(self.sums.settling).map(|time| time * 1e3),
            overshoot_mm: Some(self.sums.overshoot * 1e3),
            gate_margin_mm: self.sums.margin.map(|margin| margin * 1e3),
            torque_share: Some(greatest(summary.torque_utilisation)),
            torque_rate_share: Some(self.rate_share),
            speed_share: Some(greatest(summary.speed_utilisation)),
            rms_share: Some(self.load.rms_share(ratings, 1.0)),
            continuous_speed: speed,
            continuous_cycle_s: speed.map(|speed| planned / speed),
            pause_s: self.load.pause(ratings, planned),
            saturation_ms: Some(greatest(summary.longest_saturation_s) * 1e3),
        }
    }

    fn watch(&mut self, truth: &Truth) {
        let now = truth.plant.t;
        let moves = truth.mind.qd.iter().any(|qd| *qd != 0.0);
        let moved = self.way.is_some_and(|way| way.ended.is_none());
        if moves && !moved {
            self.conclude();
            let [a, b] = self.course.ends;
            let (from, to) = if self.ways.is_multiple_of(2) {
                (a, b)
            } else {
                (b, a)
            };
            self.way = Some(Way {
                from,
                to,
                started: self.before.map_or(now, |(before, _)| before),
                ended: None,
                since: [None; RADII.len()],
            });
        }
        let smooth = self.efforts(truth, moves || moved);
        if let Some((_, before)) = self.before {
            let limits = &self.robot.limits;
            for axis in 0..4 {
                let allowed = limits.effort[axis] / limits.effort_rise_time[axis] * self.period;
                let share = (smooth[axis] - before[axis]).abs() / allowed;
                self.rate_share = self.rate_share.max(share);
            }
        }
        self.before = Some((now, smooth));
        let Some(way) = &mut self.way else { return };
        if !moves {
            way.ended.get_or_insert(now);
        }
        let tool = &truth.plant.tool;
        let offset = Offset::between(tool, &way.to);
        for (radius, since) in RADII.into_iter().zip(&mut way.since) {
            if offset.is_within(radius) {
                since.get_or_insert(now);
            } else {
                *since = None;
            }
        }
        let (behind, ahead) = (across(tool, &way.from), across(tool, &way.to));
        let height = tool[2] - way.to[2];
        if moves {
            let (near, away) = if behind < ahead {
                (&way.from, behind)
            } else {
                (&way.to, ahead)
            };
            let margin = tool[2] - near[2] - away.min(self.course.top - near[2]);
            self.sums.margin = Some(self.sums.margin.map_or(margin, |least| least.min(margin)));
        }
        if ahead < behind {
            let past = behind - across(&way.from, &way.to);
            self.sums.overshoot = self.sums.overshoot.max(past).max(-height);
        }
    }

    /// Takes account of the efforts of a sample; returns them without dry friction.
    fn efforts(&mut self, truth: &Truth, moving: bool) -> [f64; 4] {
        let (q, qd): (Vector4<f64>, Vector4<f64>) = (truth.plant.q.into(), truth.plant.qd.into());
        let weight = self.arm.gravity(&self.arm.at(&q));
        let friction = self.drive.friction(&qd);
        let viscous = qd.component_mul(&Vector4::from(self.robot.drive.viscous));
        let dry = friction - viscous;
        let effort = truth.plant.tau;
        if moving {
            let parts = std::array::from_fn(|axis| {
                let constant = weight[axis] + dry[axis];
                let rest = effort[axis] - constant - viscous[axis];
                [constant, viscous[axis], rest]
            });
            self.load.moving(&parts);
        } else {
            self.load.resting(&effort);
        }
        std::array::from_fn(|axis| effort[axis] - dry[axis])
    }

    /// Adds up the way that has ended.
    fn conclude(&mut self) {
        let Some(way) = self.way.take() else { return };
        let ended = way.ended.unwrap_or(way.started);
        self.ways += 1;
        let sums = &mut self.sums;
        sums.planned += ended - way.started;
        let so_far = sums.arrived.unwrap_or([Some(0.0); RADII.len()]);
        let mut arrived = so_far;
        for (sum, since) in arrived.iter_mut().zip(way.since) {
            *sum = sum.zip(since).map(|(sum, since)| sum + since - way.started);
        }
        sums.arrived = Some(arrived);
        if let [.., Some(fine)] = way.since {
            let settling = (fine - ended).max(0.0);
            sums.settling = Some(sums.settling.map_or(settling, |most| most.max(settling)));
        }
    }
}

/// Horizontal distance of two places.
fn across(a: &[f64; 4], b: &[f64; 4]) -> f64 {
    libm::hypot(a[0] - b[0], a[1] - b[1])
}

impl Observer for Watch {
    fn sample(&mut self, truth: &Truth) -> io::Result<()> {
        if self.on {
            self.watch(truth);
        }
        Ok(())
    }

    fn cell_event(&mut self, event: &CellEvent) {
        match event {
            CellEvent::BeginCycle => self.on = true,
            CellEvent::EndCycle => {
                self.conclude();
                self.on = false;
            }
            CellEvent::Attach(_) | CellEvent::Release => {}
        }
    }
}
