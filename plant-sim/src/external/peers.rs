//! Peers on the bus: no other plant, and one controller.

use std::time::{Duration, Instant};

use link::{Link, LinkAddress};
use protocol::bus::Bus as _;
use protocol::codec;
use protocol::frame::CanFrame;
use protocol::messages::{Message, Nmt, Node as Name};
use protocol::table;

use super::Remote;
use crate::interrupt;
use crate::say;
use sim::peer::PeerError;

/// Time to listen on a bus before taking part: longer than the interval between two frames of a waiting plant.
const LISTEN: Duration = Duration::from_millis(300);
/// Interval of reset requests while no controller answers.
const RETRY: Duration = Duration::from_millis(200);
/// Longest wait for a controller.
const MEET_LIMIT: Duration = Duration::from_secs(60);

/// Node that sends this frame, if only one may. A parameter request may come from another tool
/// (`plant-sim parameters`) and does not indicate a second plant, nor does a bad frame. What the controller sends is
/// compared, right or wrong.
pub(crate) fn sender(frame: &CanFrame) -> Option<Name> {
    table::of_frame(frame)
        .filter(|info| info.id != table::CONTROLLER_PARAMETER_REQUEST.id)
        .and_then(|info| info.sender)
        .filter(|name| *name == Name::Controller || codec::decode(frame).is_ok())
}

/// Opens the bus, makes sure that no other plant is on it, and waits for a controller, which is reset.
pub(crate) fn meet(address: &LinkAddress) -> Result<Remote, PeerError> {
    let bus = address.to_string();
    let link = Link::open(address).map_err(|error| PeerError {
        who: format!("on {bus}"),
        what: format!("is out of reach: {error}"),
    })?;
    let mut remote = Remote {
        link,
        bus,
        met: false,
        lost: None,
    };
    hear(&mut remote, LISTEN, false)?;
    let began = Instant::now();
    let mut told = false;
    loop {
        // Lets another plant that starts detect this one while it waits.
        remote.send(&reset());
        if hear(&mut remote, RETRY, true)? {
            // The controller may have received that or have just started by itself: it is reset now, before the first
            // sample.
            remote.send(&reset());
            if told {
                say!("plant-sim: the controller is there");
            }
            remote.met = true;
            return Ok(remote);
        }
        if interrupt::asked() {
            return Err(remote.error(format!("did not appear: {}", interrupt::error())));
        }
        if began.elapsed() > MEET_LIMIT {
            return Err(remote.error(format!("did not appear within {} s", MEET_LIMIT.as_secs())));
        }
        if !told {
            told = true;
            say!(
                "plant-sim: waiting for a controller; start it with: controller --bus {}",
                remote.bus
            );
        }
    }
}

/// Listens until the time is over or, if `controller`, until a controller sends: `true` then.
fn hear(remote: &mut Remote, time: Duration, controller: bool) -> Result<bool, PeerError> {
    let end = Instant::now() + time;
    loop {
        while let Some(frame) = remote.link.receive() {
            match sender(&frame) {
                Some(Name::Drives | Name::Operator) => {
                    return Err(PeerError {
                        who: format!("on {}", remote.bus),
                        what: format!(
                            "belongs to another plant, which sends {frame}; stop one of the two"
                        ),
                    });
                }
                Some(Name::Controller) if controller => return Ok(true),
                _ => {}
            }
        }
        let left = end.saturating_duration_since(Instant::now());
        if left.is_zero() {
            return Ok(false);
        }
        remote.wait(left);
        if let Some(why) = &remote.lost {
            return Err(remote.error(why.clone()));
        }
    }
}

/// Reset command to the controller.
pub(crate) fn reset() -> CanFrame {
    codec::encode(&Message::Nmt(Nmt::reset(Name::Controller)), 0).expect("two bytes without floats")
}
