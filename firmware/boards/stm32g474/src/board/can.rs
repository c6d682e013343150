//! FDCAN1: 1 Mbit/s nominal, 5 Mbit/s data, with hardware filters for the messages of the bench.

use core::num::{NonZeroU8, NonZeroU16};

use embassy_stm32::can::config::{
    DataBitTiming, FdCanConfig, FrameTransmissionConfig, GlobalFilter, NominalBitTiming,
    TxBufferMode,
};
use embassy_stm32::can::enums::BusErrorMode;
use embassy_stm32::can::filter::{Action, FilterType, StandardFilter, StandardFilterSlot};
use embassy_stm32::can::frame::{FdFrame, Header};
use embassy_stm32::can::{
    BufferedCanFd, BufferedFdCanReceiver, BufferedFdCanSender, CanConfigurator,
    IT0InterruptHandler, IT1InterruptHandler, OperatingMode, RxFdBuf, TxFdBuf,
};
use embassy_stm32::peripherals::{FDCAN1, PA11, PA12};
use embassy_stm32::{Peri, bind_interrupts, pac};
use protocol::bus::{Bus, Transmit, TransmitError};
use protocol::codec;
use protocol::frame::{CanFrame, FrameKind, StandardId};
use protocol::messages::{EStop, EStopReason, Message};
use protocol::table;

/// Queue of frames received.
pub(crate) type Received = RxFdBuf<RECEIVED>;
/// Queue of frames to be sent.
pub(crate) type ToSend = TxFdBuf<TO_SEND>;

/// Frames that may wait between interrupt and loop, besides three in hardware in each direction.
const RECEIVED: usize = 16;
const TO_SEND: usize = 8;

/// A filter for each message of the bench: what others send with this node's identifiers has to arrive, too. Everything else is blocked,
/// including extended and remote frames.
const FILTERS: [StandardFilterSlot; table::TABLE.len()] = {
    use StandardFilterSlot as Slot;
    [
        Slot::_0,
        Slot::_1,
        Slot::_2,
        Slot::_3,
        Slot::_4,
        Slot::_5,
        Slot::_6,
        Slot::_7,
        Slot::_8,
        Slot::_9,
        Slot::_10,
        Slot::_11,
        Slot::_12,
        Slot::_13,
        Slot::_14,
        Slot::_15,
        Slot::_16,
    ]
};

/// Time quanta of 12.5 ns. Nominal: 1 + 63 + 16, sample point at 80 %.
#[allow(clippy::unwrap_used, reason = "evaluated when the image is compiled")]
const NOMINAL: NominalBitTiming = NominalBitTiming {
    prescaler: NonZeroU16::MIN,
    seg1: NonZeroU8::new(63).unwrap(),
    seg2: NonZeroU8::new(16).unwrap(),
    sync_jump_width: NonZeroU8::new(16).unwrap(),
};
/// Data: 1 + 11 + 4, sample point at 75 %.
#[allow(clippy::unwrap_used, reason = "evaluated when the image is compiled")]
const DATA: DataBitTiming = DataBitTiming {
    transceiver_delay_compensation: true,
    prescaler: NonZeroU16::MIN,
    seg1: NonZeroU8::new(11).unwrap(),
    seg2: NonZeroU8::new(4).unwrap(),
    sync_jump_width: NonZeroU8::new(4).unwrap(),
};
/// Secondary sample point after the measured delay: where the data sample point is in the bit.
const DELAY_OFFSET: u8 = 12;

bind_interrupts!(struct Interrupts {
    FDCAN1_IT0 => IT0InterruptHandler<FDCAN1>;
    FDCAN1_IT1 => IT1InterruptHandler<FDCAN1>;
});

/// The CAN controller with its queues.
pub(crate) struct Can {
    driver: BufferedCanFd<'static, TO_SEND, RECEIVED>,
    reader: BufferedFdCanReceiver,
    writer: BufferedFdCanSender,
}

impl Can {
    /// Joins the bus.
    pub(crate) fn start(
        peripheral: Peri<'static, FDCAN1>,
        rx: Peri<'static, PA11>,
        tx: Peri<'static, PA12>,
        to_send: &'static mut ToSend,
        received: &'static mut Received,
    ) -> Self {
        let mut can = CanConfigurator::new(peripheral, rx, tx, Interrupts);
        for (slot, message) in FILTERS.into_iter().zip(table::TABLE) {
            let id = StandardId::new(message.id).unwrap_or(StandardId::MAX);
            let filter = FilterType::DedicatedSingle(id);
            let action = Action::StoreInFifo0;
            can.properties()
                .set_standard_filter(slot, StandardFilter { filter, action });
        }
        can.set_config(
            FdCanConfig::default()
                .set_nominal_bit_timing(NOMINAL)
                .set_data_bit_timing(DATA)
                .set_frame_transmit(FrameTransmissionConfig::AllowFdCanAndBRS)
                .set_global_filter(GlobalFilter::reject_all())
                // By identifier: the oldest frame must not hold back the most urgent one.
                .set_tx_buffer_mode(TxBufferMode::Priority)
                // When to recover is the loop's: see [`Port::rejoin`].
                .set_automatic_bus_off_recovery(false),
        );
        let driver = can.start(OperatingMode::NormalOperationMode);
        compensate_delay();
        let driver = driver.buffered_fd(to_send, received);
        Self {
            reader: driver.reader(),
            writer: driver.writer(),
            driver,
        }
    }
}

/// Transceiver delay compensation (ISO 11898-1, 11.3.3): at 5 Mbit/s a bit is shorter than the delay to the bus and
/// back. The driver has no setting for it and writes the registers when it starts.
fn compensate_delay() {
    let can = pac::FDCAN1;
    can.cccr().modify(|w| w.set_init(true));
    while !can.cccr().read().init() {}
    can.cccr().modify(|w| w.set_cce(true));
    can.tdcr().write(|w| w.set_tdco(DELAY_OFFSET));
    can.dbtp().modify(|w| w.set_tdc(true));
    // Also clears CCE.
    can.cccr().modify(|w| w.set_init(false));
}

/// The node's end of the bus.
pub(crate) struct Port {
    can: Can,
    /// A frame already taken from the queue by [`Self::has_frames`].
    next: Option<CanFrame>,
    estop: bool,
    /// The emergency-stop chain has opened, and the node has not been notified yet.
    estop_due: bool,
    /// As last seen, and whether that has begun since [`Self::has_gone_off`].
    offline: bool,
    went_off: bool,
}

impl Port {
    pub(crate) fn new(can: Can) -> Self {
        Self {
            can,
            next: None,
            estop: false,
            estop_due: false,
            offline: false,
            went_off: false,
        }
    }

    /// Notes the emergency-stop chain. While it is open the node is notified in every call, the other nodes once; after
    /// that they see it in the state.
    pub(crate) fn set_estop(&mut self, pressed: bool) {
        if pressed && !self.estop {
            defmt::warn!("emergency-stop chain open");
            if let Some(frame) = estop_frame() {
                let _ = self.transmit(&frame);
            }
        }
        self.estop = pressed;
        self.estop_due = pressed;
    }

    /// Whether the node is bus-off now.
    fn is_offline(&mut self) -> bool {
        let mode = self.can.driver.properties().bus_error_mode();
        let offline = matches!(mode, BusErrorMode::BusOff);
        if offline != self.offline {
            self.offline = offline;
            self.went_off |= offline;
            defmt::warn!("bus-off: {}", offline);
        }
        offline
    }

    /// Whether the node has gone bus-off since the last call.
    pub(crate) fn has_gone_off(&mut self) -> bool {
        self.is_offline();
        core::mem::take(&mut self.went_off)
    }

    /// Begins the recovery from bus-off, which takes 128 times 11 recessive bits. The CAN controller has set INIT by itself.
    pub(crate) fn rejoin(&mut self) {
        pac::FDCAN1.cccr().modify(|w| w.set_init(false));
    }

    /// Whether a frame is waiting.
    pub(crate) fn has_frames(&mut self) -> bool {
        // The queue holds frames interspersed with bus errors, which the CAN controller handles by itself.
        while self.next.is_none() {
            match self.can.reader.try_receive() {
                Ok(Ok(envelope)) => self.next = from_driver(&envelope.frame),
                Ok(Err(_)) => {}
                Err(_) => return false,
            }
        }
        true
    }
}

impl Bus for Port {
    fn receive(&mut self) -> Option<CanFrame> {
        if self.estop_due {
            self.estop_due = false;
            return estop_frame();
        }
        self.has_frames();
        self.next.take()
    }
}

impl Transmit for Port {
    fn transmit(&mut self, frame: &CanFrame) -> Result<(), TransmitError> {
        if self.is_offline() {
            return Err(TransmitError::Offline);
        }
        let frame = to_driver(frame).ok_or(TransmitError::QueueFull)?;
        self.can
            .writer
            .try_write(frame)
            .map_err(|_| TransmitError::QueueFull)
    }
}

fn estop_frame() -> Option<CanFrame> {
    let estop = EStop {
        reason: EStopReason::BUTTON,
        counter: 0,
    };
    codec::encode(&Message::EStop(estop), 0).ok()
}

/// A frame as received; `None` for a remote frame, which the filters block.
fn from_driver(frame: &FdFrame) -> Option<CanFrame> {
    let header = frame.header();
    let data = frame.data().get(..usize::from(header.len()))?;
    if header.rtr() {
        None
    } else if header.fdcan() {
        CanFrame::fd(*header.id(), data, header.bit_rate_switching())
    } else {
        CanFrame::classical(*header.id(), data)
    }
}

fn to_driver(frame: &CanFrame) -> Option<FdFrame> {
    let data = frame.data();
    let len = data.len() as u8;
    let header = match frame.kind() {
        FrameKind::Classical { remote } => Header::new(frame.id(), len, remote),
        FrameKind::Fd { brs, .. } => Header::new_fd(frame.id(), len, false, brs),
    };
    FdFrame::new(header, data).ok()
}
