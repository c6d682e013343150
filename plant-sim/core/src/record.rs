//! Observers that record a run: its trace and its truth, as text into any sink.

use std::io::{self, Write};

use protocol::frame::CanFrame;
use protocol::time::Instant;
use trace::{Interface, LogHash, Writer};

use crate::observer::{Observer, Truth};

/// Every frame, as `candump -L` writes it.
pub struct TraceLog<W: Write>(Writer<W>);

impl<W: Write> TraceLog<W> {
    /// An empty log that goes into `sink`.
    pub fn new(sink: W) -> Self {
        Self(Writer::new(sink, Interface::CAN0))
    }

    /// The sink, flushed, and the hash of the log.
    ///
    /// # Errors
    /// Those of the sink.
    pub fn finish(self) -> io::Result<(W, LogHash)> {
        self.0.finish()
    }
}

impl<W: Write> Observer for TraceLog<W> {
    fn frame(&mut self, time: Instant, frame: &CanFrame) -> io::Result<()> {
        self.0.frame(time.micros(), frame)
    }
}

const TRUTH_HEADER: &str = "t,q1,q2,q3,q4,qd1,qd2,qd3,qd4,rq1,rq2,rq3,rq4,rqd1,rqd2,rqd3,rqd4,\
                            tau1,tau2,tau3,tau4,x,y,z,yaw\n";

/// One row per sample: actual motion of the robot and its reference.
pub struct TruthLog<W: Write>(W);

impl<W: Write> TruthLog<W> {
    /// A table with its header that goes into `sink`.
    ///
    /// # Errors
    /// Those of the sink.
    pub fn new(mut sink: W) -> io::Result<Self> {
        sink.write_all(TRUTH_HEADER.as_bytes())?;
        Ok(Self(sink))
    }

    /// The sink, flushed.
    ///
    /// # Errors
    /// Those of the sink.
    pub fn finish(mut self) -> io::Result<W> {
        self.0.flush()?;
        Ok(self.0)
    }
}

impl<W: Write> Observer for TruthLog<W> {
    fn sample(&mut self, truth: &Truth) -> io::Result<()> {
        // The standard library's float formatting would take a third of the run's time.
        let mut digits = zmij::Buffer::new();
        self.0.write_all(digits.format(truth.plant.t).as_bytes())?;
        for group in [
            &truth.plant.q,
            &truth.plant.qd,
            &truth.mind.q,
            &truth.mind.qd,
            &truth.plant.tau,
            &truth.plant.tool,
        ] {
            for value in group {
                self.0.write_all(b",")?;
                self.0.write_all(digits.format(*value).as_bytes())?;
            }
        }
        self.0.write_all(b"\n")
    }
}
