//! Gains over the bus, one by one.

use protocol::messages::{ParameterError, ParameterReply, ParameterRequest};
use protocol::parameters::ControllerParameter;

use crate::parameters::Client;

/// Each of these is in its range and would leave the loop no margin together with the others; the limit that comes with the
/// refusal is accepted.
#[test]
fn gains_and_delay_have_to_fit_each_other() {
    for (parameter, value) in [
        (ControllerParameter::Damping, 5.0),
        (ControllerParameter::Damping, 0.1),
        (ControllerParameter::CommandDelay, 2e-3),
    ] {
        let mut bench = Client::new();
        let before = bench.get(parameter);
        let index = parameter.rule().number;
        let ParameterReply::Error { error, limit, .. } =
            bench.reply(ParameterRequest::Set { index, value })
        else {
            panic!("{parameter:?} = {value} was accepted");
        };
        assert_eq!(error, ParameterError::OutOfRange);
        assert_eq!(bench.get(parameter), before);
        assert!(
            (limit - before).abs() > 0.2 * before,
            "{parameter:?}: {limit}"
        );
        bench.set(parameter, limit);
    }
}
