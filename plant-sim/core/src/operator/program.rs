//! A scenario as a list of actions.

use protocol::messages::{Mode, MotionRequest};
use protocol::time::Duration;

use super::CellEvent;
use crate::scenario::{PayloadSpec, Scenario, Step};

/// Wait after enabling, until brake and observer have settled.
const SETTLING: Duration = Duration::from_millis(100);

/// One action.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Action {
    Hello,
    Request(MotionRequest),
    WaitMode(Mode),
    WaitArrived,
    Dwell(Duration),
    Cell(CellEvent),
}

/// All actions, in order.
pub(super) fn program(scenario: &Scenario) -> Vec<Action> {
    let announce = |payload: &PayloadSpec| {
        Action::Request(MotionRequest::SetPayload {
            mass: payload.mass as f32,
            com: payload.com_flange_frame.map(|x| x as f32),
            inertia: payload.inertia_com_diag.map(|x| x as f32),
        })
    };
    let nothing = PayloadSpec {
        mass: 0.0,
        com_flange_frame: [0.0; 3],
        inertia_com_diag: [0.0; 3],
    };
    let carried = |payload: &PayloadSpec| payload.scaled(scenario.mismatch.payload).into();
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
    if let Some(gains) = &scenario.gains {
        actions.push(Action::Request(MotionRequest::SetGains {
            bandwidth: gains.bandwidth as f32,
            damping: gains.damping as f32,
            observer: gains.observer as f32,
        }));
    }
    if let Some(payload) = &scenario.payload {
        actions.extend([
            Action::Cell(CellEvent::Attach(carried(payload))),
            announce(payload),
        ]);
    }
    actions.extend([
        Action::Request(MotionRequest::Enable),
        Action::WaitMode(Mode::Enabled),
        Action::Dwell(SETTLING),
    ]);
    for _ in 0..scenario.cycles {
        actions.push(Action::Cell(CellEvent::BeginCycle));
        for step in &scenario.cycle {
            match step {
                Step::Jump(jump) => actions.push(Action::Request(MotionRequest::Jump {
                    target: jump.to.map(|x| x as f32),
                    top: jump.top as f32,
                    clearance: jump.clearance as f32,
                    speed: jump.speed as f32,
                })),
                Step::Line(line) => actions.push(Action::Request(MotionRequest::MoveLine {
                    target: line.to.map(|x| x as f32),
                    speed: line.speed as f32,
                })),
                Step::Joints(line) => actions.push(Action::Request(MotionRequest::MoveJoint {
                    target: line.to.map(|x| x as f32),
                    speed: line.speed as f32,
                })),
                Step::Dwell(seconds) => actions.extend([
                    Action::WaitArrived,
                    Action::Dwell(Duration::from_seconds(*seconds)),
                ]),
                Step::Stop(seconds) => actions.extend([
                    Action::Dwell(Duration::from_seconds(*seconds)),
                    Action::Request(MotionRequest::Stop),
                ]),
                Step::Pick(payload) => actions.extend([
                    Action::WaitArrived,
                    Action::Cell(CellEvent::Attach(carried(payload))),
                    announce(payload),
                ]),
                Step::Place {} => actions.extend([
                    Action::WaitArrived,
                    Action::Cell(CellEvent::Release),
                    announce(&nothing),
                ]),
            }
        }
        actions.extend([Action::WaitArrived, Action::Cell(CellEvent::EndCycle)]);
    }
    actions.extend([
        Action::Request(MotionRequest::Disable),
        Action::WaitMode(Mode::Ready),
    ]);
    actions
}
