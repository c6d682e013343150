//! A trace or a run as MCAP, for Foxglove and Lichtblick: frames, joint states, and an arm that moves.
//!
//! Joint states, transforms and the scene are messages of Foxglove, which both programs know. Neither has one for a CAN frame;
//! its schema is in the file.

mod messages;
mod scene;

use std::collections::{BTreeMap, HashMap};
use std::io::{self, Write};

use firmware::mechanics::arm::ArmModel;
use firmware::mechanics::dynamics::drive::Drive;
use foxglove::Encode;
use foxglove::messages::Timestamp;
use mcap::records::MessageHeader;
use mcap::write::NoSeek;
use mcap::{McapError, WriteOptions};
use nalgebra::Vector4;
use protocol::codec;
use protocol::frame::CanFrame;
use protocol::messages::{Feedback, Message};
use protocol::time::{Duration, Instant};
use sim::model::{Geometry, RobotModel};
use sim::observer::{Observer, Truth};
use sim::record::of_run;
use trace::{Entry, ErrorFrame, Interface, Record};

use messages::{can_frame, joint_states, transforms};

/// Writes an MCAP file, front to end. Of what has been written it keeps an index, a few hundred bytes per megabyte.
pub struct Recorder<W: Write> {
    writer: mcap::Writer<NoSeek<W>>,
    drive: Drive,
    rated: Vector4<f32>,
    geometry: Geometry,
    /// Channels by topic, and the number of their next message.
    channels: HashMap<String, (u16, u32)>,
    /// The interface whose arm is shown.
    shown: Option<Interface>,
    encoded: Vec<u8>,
}

impl<W: Write> Recorder<W> {
    /// Begins a file about this robot.
    ///
    /// # Errors
    /// Those of the sink.
    pub fn new(sink: W, model: &RobotModel) -> io::Result<Self> {
        let options = WriteOptions::new()
            // The libraries of lz4 and zstd take longer to compile than all else here needs for it, and every first run would
            // pay that; `mcap compress` makes a third of the bytes.
            .compression(None)
            .disable_seeking(true)
            .library(concat!("plant-sim ", env!("CARGO_PKG_VERSION")));
        let arm = ArmModel::from(model);
        Ok(Self {
            writer: options.create(NoSeek::new(sink)).map_err(failed)?,
            drive: Drive::new(&arm.drive),
            rated: arm.drive.motor_torque_rated,
            geometry: model.geometry,
            channels: HashMap::new(),
            shown: None,
            encoded: Vec::new(),
        })
    }

    /// Appends a record of a trace, and what its frame says of the arm.
    ///
    /// # Errors
    /// Those of the sink.
    pub fn record(&mut self, record: &Record) -> io::Result<()> {
        let time = messages::time(record.time_us);
        let interface = record.interface;
        let frame = can_frame(time, &record.entry);
        self.put(&format!("/{interface}/frames"), time, &frame)?;
        if let Entry::Frame(frame) = &record.entry
            && let Ok(received) = codec::decode(frame)
            && let Message::Feedback(feedback) = received.message
        {
            self.feedback(interface, time, &feedback)?;
        }
        Ok(())
    }

    /// The joints by their encoders, as the controller reads them.
    fn feedback(
        &mut self,
        interface: Interface,
        time: Timestamp,
        feedback: &Feedback,
    ) -> io::Result<()> {
        let motors = self.drive.motor_angle_of_counts(&feedback.position);
        let q = self.drive.joint_angle(&motors);
        let qd = self.drive.joint_speed(&feedback.velocity.into());
        let shares = Vector4::from(feedback.torque.map(|share| f32::from(share) / 1000.0));
        let effort = self.drive.joint_torque(&shares.component_mul(&self.rated));
        let [q, qd, effort] = [q, qd, effort].map(|v| [v.x, v.y, v.z, v.w].map(f64::from));
        let states = joint_states(time, &q, &qd, Some(&effort));
        self.put(&format!("/{interface}/joint_states"), time, &states)?;
        if self.shown.is_none() {
            self.shown = Some(interface);
            self.put("/scene", time, &scene::arm(time, &self.geometry))?;
        }
        if self.shown == Some(interface) {
            self.put("/tf", time, &transforms(time, &self.geometry, &q))?;
        }
        Ok(())
    }

    fn put<T: Encode>(&mut self, topic: &str, time: Timestamp, message: &T) -> io::Result<()> {
        if !self.channels.contains_key(topic) {
            let channel = self.channel::<T>(topic).map_err(failed)?;
            self.channels.insert(topic.into(), (channel, 0));
        }
        let Some((channel_id, sequence)) = self.channels.get_mut(topic) else {
            return Ok(());
        };
        let nanos = messages::nanos(time);
        let header = MessageHeader {
            channel_id: *channel_id,
            sequence: *sequence,
            log_time: nanos,
            publish_time: nanos,
        };
        *sequence = sequence.wrapping_add(1);
        self.encoded.clear();
        message
            .encode(&mut self.encoded)
            .map_err(|error| io::Error::other(error.to_string()))?;
        self.writer
            .write_to_known_channel(&header, &self.encoded)
            .map_err(failed)
    }

    fn channel<T: Encode>(&mut self, topic: &str) -> Result<u16, McapError> {
        // Number 0 is that of no schema.
        let schema = T::get_schema().map_or(Ok(0), |schema| {
            self.writer
                .add_schema(&schema.name, &schema.encoding, &schema.data)
        })?;
        let encoding = T::get_message_encoding();
        self.writer
            .add_channel(schema, topic, &encoding, &BTreeMap::new())
    }

    /// Ends the file, flushes it and returns the sink.
    ///
    /// # Errors
    /// Those of the sink.
    pub fn finish(mut self) -> io::Result<W> {
        self.writer.finish().map_err(failed)?;
        let mut sink = self.writer.into_inner().into_inner();
        sink.flush()?;
        Ok(sink)
    }
}

/// A run as it goes: the trace, and what no frame says, the actual motion and its reference.
impl<W: Write> Observer for Recorder<W> {
    fn frame(&mut self, time: Instant, frame: &CanFrame) -> io::Result<()> {
        self.record(&of_run(time, Entry::Frame(*frame)))
    }

    fn error(&mut self, time: Instant, error: &ErrorFrame, _: Duration) -> io::Result<()> {
        self.record(&of_run(time, Entry::Error(*error)))
    }

    fn sample(&mut self, truth: &Truth) -> io::Result<()> {
        let (plant, mind) = (&truth.plant, &truth.mind);
        let time = messages::time((plant.t * 1e6).round() as u64);
        let actual = joint_states(time, &plant.q, &plant.qd, Some(&plant.tau));
        self.put("/actual/joint_states", time, &actual)?;
        let reference = joint_states(time, &mind.q, &mind.qd, None);
        self.put("/reference/joint_states", time, &reference)
    }
}

fn failed(error: McapError) -> io::Error {
    match error {
        McapError::Io(error) => error,
        error => io::Error::other(error),
    }
}
