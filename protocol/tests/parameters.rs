//! The parameter table and the server that both nodes share.

#![allow(
    clippy::expect_used,
    clippy::indexing_slicing,
    clippy::panic,
    clippy::unwrap_used,
    reason = "a test fails by panicking"
)]

use std::collections::{HashMap, HashSet};

use proptest::prelude::*;
use protocol::messages::{
    Hello, Message, ParameterError, ParameterReply, ParameterRequest, Server,
};
use protocol::parameters::{
    self, ControllerParameter, DriveParameter, Field, Kind, Listed, Rule, Settable, Store, serve,
};

/// A node that keeps its values in a map; the sampling period is 1 ms.
struct Bench<P> {
    real: HashMap<u16, f32>,
    whole: HashMap<u16, u32>,
    at_rest: bool,
    changed: Vec<P>,
}

impl<P> Bench<P> {
    fn new() -> Self {
        let mut bench = Self {
            real: HashMap::new(),
            whole: HashMap::new(),
            at_rest: true,
            changed: Vec::new(),
        };
        for parameter in parameters::all() {
            let value = parameter
                .default
                .map_or(parameter.rule.lower, |level| level.at(1e-3));
            if parameter.rule.kind == Kind::Whole {
                bench.whole.insert(parameter.rule.number, value as u32);
            } else {
                bench.real.insert(parameter.rule.number, value);
            }
        }
        bench
    }
}

impl<P: Listed> Store for Bench<P> {
    type Parameter = P;

    fn period(&self) -> f32 {
        1e-3
    }

    fn is_at_rest(&self) -> bool {
        self.at_rest
    }

    fn field(&mut self, parameter: P) -> Field<'_> {
        let Rule { number, kind, .. } = rule(parameter);
        if kind == Kind::Whole {
            Field::Whole(self.whole.get_mut(&number).unwrap())
        } else {
            Field::Real(self.real.get_mut(&number).unwrap())
        }
    }

    fn changed(&mut self, parameter: P) {
        self.changed.push(parameter);
    }
}

fn rule<P: Listed>(parameter: P) -> Rule {
    let position = P::ALL.iter().position(|listed| *listed == parameter);
    P::RULES[position.expect("every one is listed")]
}

type Controller = Bench<ControllerParameter>;

fn ask(bench: &mut Controller, request: ParameterRequest) -> ParameterReply {
    serve(bench, &request).expect("only hello is answered elsewhere")
}

/// The error and its limit.
fn error(bench: &mut Controller, request: ParameterRequest) -> (ParameterError, f32) {
    match ask(bench, request) {
        ParameterReply::Error { error, limit, .. } => (error, limit),
        other => panic!("{other:?}"),
    }
}

fn value(bench: &mut Controller, request: ParameterRequest) -> f32 {
    match ask(bench, request) {
        ParameterReply::Value { value, .. } => value,
        other => panic!("{other:?}"),
    }
}

const BANDWIDTH: u16 = ControllerParameter::Bandwidth.rule().number;
const FAULT_SAMPLES: u16 = ControllerParameter::FaultSamples.rule().number;

#[test]
fn when_a_parameter_may_be_set_has_a_text() {
    let texts = [Settable::Never, Settable::AtRest, Settable::Always].map(Settable::name);
    assert_eq!(texts, ["never", "at rest", "always"]);
}

#[test]
fn names_are_unique_and_numbers_are_found() {
    let mut names = HashSet::new();
    for parameter in parameters::all() {
        let name = parameter.name;
        assert!(names.insert(name), "{name}");
        assert!(
            name.chars().all(|c| c.is_ascii_lowercase() || c == '-'),
            "{name}"
        );
        assert_eq!(parameters::named(name), Some(parameter));
        assert_eq!(parameters::numbered(parameter.rule.number), Some(parameter));
        assert_eq!(
            parameter.default.is_none(),
            parameter.rule.settable == Settable::Never,
            "{name}: a reading has no default, and everything else has one"
        );
        assert!(
            parameter.about.ends_with('.') && parameter.about.is_ascii(),
            "{name}"
        );
    }
    assert_eq!(parameters::named("bandwith"), None);
    assert_eq!(parameters::numbered(0x0FFF), None);
}

/// What a released client knows about a number stays true: rows are added, never changed.
#[test]
fn numbers_are_frozen() {
    let frozen = "\
        0000 sampling-period s, 0001 payload-mass kg, 0010 bandwidth rad/s, 0011 damping , 0012 observer rad/s, \
        0013 command-delay s, 0020 following-error-shoulder rad, 0021 following-error-elbow rad, \
        0022 following-error-lift m, 0023 following-error-wrist rad, 0024 range-margin-shoulder rad, \
        0025 range-margin-elbow rad, 0026 range-margin-lift m, 0027 range-margin-wrist rad, 0028 speed-factor , \
        0029 fault-samples samples, 0030 brake-delay s, 0031 feedback-timeout s, 0032 feedback-gap s, \
        0033 bad-frames frames, 1000 rated-torque-shoulder N m, 1001 rated-torque-elbow N m, \
        1002 rated-torque-lift N m, 1003 rated-torque-wrist N m, 1010 torque-limit-shoulder , \
        1011 torque-limit-elbow , 1012 torque-limit-lift , 1013 torque-limit-wrist , 1020 hold-samples samples";
    let rows: Vec<String> = parameters::all()
        .map(|p| format!("{:04x} {} {}", p.rule.number, p.name, p.unit))
        .collect();
    for row in frozen.split(", ") {
        assert!(rows.iter().any(|found| found == row), "{row}");
    }
}

/// 0.25 rad per sample: 250 rad/s at 1 kHz, 62.5 at 250 Hz, and never more than 1000.
#[test]
fn corner_frequencies_are_bounded_by_the_sampling_period() {
    let rule = ControllerParameter::Bandwidth.rule();
    for (period, bound) in [(1e-3, 250.0), (4e-3, 62.5), (1e-4, 1000.0)] {
        let upper = rule.upper_at(period);
        assert_eq!(upper, bound, "{period} s");
        assert_eq!(rule.check(1.001 * bound, period), Err(upper));
        assert_eq!(rule.check(bound, period), Ok(()));
    }
    assert_eq!(rule.check(f32::NAN, 1e-3), Err(1.0));
    assert_eq!(rule.check(f32::NEG_INFINITY, 1e-3), Err(1.0));
}

#[test]
fn every_reply_occurs() {
    let mut bench = Controller::new();
    let set = |index, value| ParameterRequest::Set { index, value };
    assert_eq!(
        ask(&mut bench, ParameterRequest::Get { index: BANDWIDTH }),
        ParameterReply::Value {
            index: BANDWIDTH,
            value: 170.0,
            lower: 1.0,
            upper: 250.0,
        }
    );
    assert_eq!(value(&mut bench, set(BANDWIDTH, 90.0)), 90.0);
    assert_eq!(bench.changed, [ControllerParameter::Bandwidth]);
    assert_eq!(
        error(&mut bench, set(BANDWIDTH, 251.0)),
        (ParameterError::OutOfRange, 250.0)
    );
    assert_eq!(
        error(&mut bench, set(BANDWIDTH, 0.5)),
        (ParameterError::OutOfRange, 1.0)
    );
    assert_eq!(
        error(&mut bench, set(FAULT_SAMPLES, 2.5)),
        (ParameterError::OutOfRange, 2.0)
    );
    assert_eq!(
        error(&mut bench, set(0, 1e-3)),
        (ParameterError::ReadOnly, 0.0)
    );
    assert_eq!(
        error(&mut bench, ParameterRequest::Get { index: 0x0FFF }),
        (ParameterError::NotFound, 0.0)
    );
    bench.at_rest = false;
    assert_eq!(
        error(&mut bench, set(BANDWIDTH, 80.0)),
        (ParameterError::NotNow, 0.0)
    );
    // Parameters that only decide when to stop may be set at any time.
    assert_eq!(value(&mut bench, set(FAULT_SAMPLES, 2.0)), 2.0);
    assert_eq!(
        value(&mut bench, ParameterRequest::Get { index: BANDWIDTH }),
        90.0,
        "refused values change nothing"
    );
    let hello = Hello {
        schema: 0,
        build: 0,
        profile: 0,
    };
    assert_eq!(serve(&mut bench, &ParameterRequest::Hello(hello)), None);
}

/// A client that repeats the request with the next number gets every parameter once, then [`ParameterError::NotFound`].
#[test]
fn a_listing_is_complete() {
    let mut bench = Bench::<DriveParameter>::new();
    let mut from = 0;
    let mut listed = Vec::new();
    let end = loop {
        match serve(&mut bench, &ParameterRequest::List { from }) {
            Some(ParameterReply::Value { index, .. }) => {
                listed.push(index);
                from = index + 1;
            }
            other => break other,
        }
    };
    let expected: Vec<u16> = parameters::all()
        .filter(|parameter| parameter.server() == Server::Drives)
        .map(|parameter| parameter.rule.number)
        .collect();
    assert_eq!(listed, expected);
    assert!(matches!(
        end,
        Some(ParameterReply::Error {
            error: ParameterError::NotFound,
            ..
        })
    ));
}

fn request() -> impl Strategy<Value = ParameterRequest> {
    let number = prop_oneof![0..0x40u16, 0x0FF0..0x1030u16, any::<u16>()];
    let value = prop_oneof![any::<f32>(), -1.0..2.0f32, 0.0..300.0f32];
    (0..3, number, value).prop_map(|(kind, index, value)| match kind {
        0 => ParameterRequest::Get { index },
        1 => ParameterRequest::Set { index, value },
        _ => ParameterRequest::List { from: index },
    })
}

fn keeps_its_ranges<P: Listed>(requests: &[(ParameterRequest, bool)], server: Server) {
    let mut bench = Bench::<P>::new();
    for (request, at_rest) in requests {
        bench.at_rest = *at_rest;
        let reply = serve(&mut bench, request).expect("no hello");
        if let ParameterReply::Value {
            index,
            value,
            lower,
            upper,
        } = reply
        {
            assert_eq!(parameters::numbered(index).unwrap().server(), server);
            assert!(lower <= value && value <= upper, "{request:?}: {reply:?}");
        }
        // Every answer fits its frame, whatever was requested.
        protocol::codec::encode(&Message::ParameterReply(server, reply), 0).unwrap();
    }
    for rule in P::RULES {
        let value = bench.real.get(&rule.number).copied();
        let value = value.unwrap_or_else(|| bench.whole[&rule.number] as f32);
        assert_eq!(rule.check(value, 1e-3), Ok(()));
    }
}

proptest! {
    #[test]
    fn no_sequence_of_requests_leads_out_of_a_range(
        requests in prop::collection::vec((request(), any::<bool>()), 0..200)
    ) {
        keeps_its_ranges::<ControllerParameter>(&requests, Server::Controller);
        keeps_its_ranges::<DriveParameter>(&requests, Server::Drives);
    }
}
