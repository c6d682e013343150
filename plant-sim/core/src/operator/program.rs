//! A scenario as a sequence of actions, made step by step: a million cycles take no more memory than one.

use std::collections::VecDeque;

use firmware::control::laws::Gains;
use protocol::messages::{Mode, MotionRequest};
use protocol::time::Duration;

use super::CellEvent;
use crate::scenario::{Override, PayloadSpec, Release, Scenario, Source, Step};
use crate::world::Spot;

/// Wait after enabling, until brake and observer have settled.
const SETTLING: Duration = Duration::from_millis(100);

/// One action.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Action {
    Hello,
    Request(MotionRequest),
    EmergencyStop,
    /// Hold moves from now on, or let go of them.
    Hold(bool),
    WaitMode(Mode),
    WaitArrived,
    Dwell(Duration),
    Cell(CellEvent),
}

impl Action {
    /// What it waits for, as text; a request has this number.
    pub(crate) fn awaited(&self, sequence: u8) -> String {
        match self {
            Self::Hello => "reply to hello".into(),
            Self::Request(request) => {
                format!("reply to request {sequence} ({})", request.name())
            }
            Self::WaitMode(mode) => format!("state {mode}"),
            Self::WaitArrived => "end of the move".into(),
            Self::EmergencyStop | Self::Hold(_) | Self::Dwell(_) | Self::Cell(_) => {
                "end of a dwell".into()
            }
        }
    }
}

/// One action, and the step of the scenario that it belongs to.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Task {
    pub(crate) action: Action,
    pub(crate) spot: Option<Spot>,
}

/// All actions, in order.
#[derive(Clone, Debug)]
pub(crate) struct Program {
    scenario: Scenario,
    next: Part,
    /// Whether the last step is the end: the axes stay under torque.
    stays: bool,
    /// Actions left of the current part.
    ready: VecDeque<Task>,
}

/// Parts of a program.
#[derive(Clone, Copy, Debug)]
enum Part {
    Begin,
    /// Step of a cycle, both counted from 0; the step after the last one ends the cycle.
    Step(u32, usize),
    End,
    Nothing,
}

impl Program {
    /// The program of `scenario`.
    pub(crate) fn new(scenario: &Scenario) -> Self {
        let mut scenario = scenario.clone();
        // The text is only needed for messages about it.
        scenario.source = Source::default();
        Self {
            scenario,
            next: Part::Begin,
            stays: false,
            ready: VecDeque::new(),
        }
    }

    /// The same, and the axes stay under torque at its end.
    pub(crate) fn staying(self) -> Self {
        Self {
            stays: true,
            ..self
        }
    }

    /// Its cycles alone, for axes under torque.
    pub(crate) fn of_cycles(self) -> Self {
        Self {
            next: Part::Step(0, 0),
            ..self
        }
    }

    /// Replaces everything that is left by `actions`.
    pub(crate) fn only(&mut self, actions: impl IntoIterator<Item = Action>) {
        self.next = Part::Nothing;
        self.ready.clear();
        self.put(None, actions);
    }

    fn put(&mut self, spot: Option<Spot>, actions: impl IntoIterator<Item = Action>) {
        let tasks = actions.into_iter().map(|action| Task { action, spot });
        self.ready.extend(tasks);
    }

    /// Everything before the first cycle.
    fn begin(&mut self) {
        let scenario = &self.scenario;
        let mut actions = vec![
            Action::Hello,
            Action::WaitMode(Mode::Ready),
            // The controller treats an operator's first request as a possible replay, which cannot switch anything on.
            Action::Request(MotionRequest::Stop),
            Action::Request(MotionRequest::SelectLaw {
                law: scenario.law.law,
                compensation: scenario.law.compensation,
            }),
        ];
        if !scenario.operation.is_automatic() {
            let operation = scenario.operation.code();
            actions.push(Action::Request(MotionRequest::SetOperation { operation }));
        }
        if let Some(gains) = &scenario.gains {
            let [bandwidth, damping, observer] = gains
                .each(&Gains::for_period((1.0 / scenario.rate_hz) as f32))
                .map(|(_, _, value)| value as f32);
            actions.push(Action::Request(MotionRequest::SetGains {
                bandwidth,
                damping,
                observer,
            }));
        }
        if let Some(payload) = scenario.payload {
            actions.extend([self.attach(&payload), announce(&payload)]);
        }
        actions.extend([
            Action::Request(MotionRequest::Enable),
            Action::WaitMode(Mode::Enabled),
            Action::Dwell(SETTLING),
        ]);
        self.put(None, actions);
    }

    /// Presses the button of manual operation, or lets go of it.
    fn hold(&mut self, pressed: bool) {
        if !self.scenario.operation.is_automatic() {
            self.put(None, [Action::Hold(pressed)]);
        }
    }

    /// One step of a cycle.
    fn step(&mut self, spot: Spot, step: &Step) {
        let request = |request| vec![Action::Request(request)];
        let actions = match step {
            Step::Jump(jump) => request(MotionRequest::Jump {
                target: jump.to.map(|x| x as f32),
                top: jump.top as f32,
                clearance: jump.clearance as f32,
                speed: jump.speed as f32,
                posture: jump.posture(),
                zone: jump.zone as f32,
            }),
            Step::Line(line) => request(MotionRequest::MoveLine {
                target: line.to.map(|x| x as f32),
                speed: line.speed as f32,
                posture: line.posture(),
                tool_speed: line.tool_speed(),
                zone: line.zone as f32,
            }),
            Step::Arc(arc) => request(MotionRequest::MoveArc {
                target: arc.to.map(|x| x as f32),
                via: arc.via.map(|x| x as f32),
                speed: arc.speed as f32,
                posture: arc.posture(),
                tool_speed: arc.tool_speed(),
                zone: arc.zone as f32,
            }),
            Step::Joints(joints) => request(MotionRequest::MoveJoint {
                target: joints.to.map(|x| x as f32),
                speed: joints.speed as f32,
                zone: joints.zone as f32,
            }),
            Step::Dwell(seconds) => vec![
                Action::WaitArrived,
                Action::Dwell(Duration::from_seconds(*seconds)),
            ],
            Step::Stop(seconds) => vec![
                Action::Dwell(Duration::from_seconds(*seconds)),
                Action::Request(MotionRequest::Stop),
            ],
            Step::Override(Override { after, to }) => vec![
                Action::Dwell(Duration::from_seconds(*after)),
                Action::Request(MotionRequest::SetOverride { pace: *to as f32 }),
            ],
            Step::Release(Release { after, lasts }) => vec![
                Action::Dwell(Duration::from_seconds(*after)),
                Action::Hold(false),
                Action::Dwell(Duration::from_seconds(*lasts)),
                Action::Hold(true),
            ],
            Step::Estop(seconds) => vec![
                Action::Dwell(Duration::from_seconds(*seconds)),
                Action::EmergencyStop,
                Action::WaitMode(Mode::EStop),
            ],
            Step::Pick(payload) => {
                vec![Action::WaitArrived, self.attach(payload), announce(payload)]
            }
            Step::Place {} => vec![
                Action::WaitArrived,
                Action::Cell(CellEvent::Release),
                announce(&PayloadSpec::NOTHING),
            ],
        };
        self.put(Some(spot), actions);
    }

    fn attach(&self, payload: &PayloadSpec) -> Action {
        let carried = payload.scaled(self.scenario.mismatch.payload);
        Action::Cell(CellEvent::Attach(carried.into()))
    }

    /// Prepares the next part; `false` if there is none.
    fn prepare(&mut self) -> bool {
        self.next = match self.next {
            Part::Begin => {
                self.begin();
                Part::Step(0, 0)
            }
            Part::Step(cycle, _) if cycle == self.scenario.cycles => Part::End,
            Part::Step(cycle, index) => {
                let last = self.scenario.cycle.len();
                if index == 0 {
                    self.hold(true);
                    self.put(None, [Action::Cell(CellEvent::BeginCycle)]);
                }
                if let Some(step) = self.scenario.cycle.get(index).copied() {
                    let step_name = step.name();
                    self.step(
                        Spot {
                            cycle,
                            index,
                            step: step_name,
                        },
                        &step,
                    );
                    Part::Step(cycle, index + 1)
                } else {
                    let spot = self.scenario.cycle.last().map(|step| Spot {
                        cycle,
                        index: last.saturating_sub(1),
                        step: step.name(),
                    });
                    self.put(spot, [Action::WaitArrived]);
                    self.put(None, [Action::Cell(CellEvent::EndCycle)]);
                    self.hold(false);
                    Part::Step(cycle + 1, 0)
                }
            }
            Part::End if self.stays => return false,
            Part::End => {
                self.put(
                    None,
                    [
                        Action::Request(MotionRequest::Disable),
                        Action::WaitMode(Mode::Ready),
                    ],
                );
                Part::Nothing
            }
            Part::Nothing => return false,
        };
        true
    }
}

impl Iterator for Program {
    type Item = Task;

    fn next(&mut self) -> Option<Task> {
        while self.ready.is_empty() && self.prepare() {}
        self.ready.pop_front()
    }
}

fn announce(payload: &PayloadSpec) -> Action {
    Action::Request(announcement(payload))
}

pub(super) fn announcement(payload: &PayloadSpec) -> MotionRequest {
    MotionRequest::SetPayload {
        mass: payload.mass as f32,
        com: payload.com_flange_frame.map(|x| x as f32),
        inertia: payload.inertia_com_diag.map(|x| x as f32),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_program_of_very_many_cycles_is_made_step_by_step() {
        let mut scenario = Scenario::built_in("gate").unwrap();
        scenario.cycles = u32::MAX;
        let mut program = Program::new(&scenario);
        let begins = |task: &Task| task.action == Action::Cell(CellEvent::BeginCycle);
        let cycles = program.by_ref().take(100_000).filter(begins).count();
        // Three steps are two jumps, a wait and a dwell; a cycle adds its two ends and a wait.
        assert!(cycles.abs_diff(100_000_usize / 7) <= 2, "{cycles}");
        assert!(
            program.ready.capacity() < 32,
            "{}",
            program.ready.capacity()
        );
    }

    #[test]
    fn every_step_is_asked_for_in_every_cycle_and_knows_its_spot() {
        let mut scenario = Scenario::built_in("gate").unwrap();
        scenario.cycles = 2;
        let spots: Vec<_> = Program::new(&scenario)
            .filter(|task| matches!(task.action, Action::Request(MotionRequest::Jump { .. })))
            .map(|task| task.spot.unwrap().to_string())
            .collect();
        assert_eq!(
            spots,
            [
                "step 1 of cycle 1 (cycle[0].jump)",
                "step 2 of cycle 1 (cycle[1].jump)",
                "step 1 of cycle 2 (cycle[0].jump)",
                "step 2 of cycle 2 (cycle[1].jump)",
            ]
        );
    }
}
