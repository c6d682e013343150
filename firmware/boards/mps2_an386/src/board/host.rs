//! Files of the host, by Arm semihosting (*Semihosting for AArch32 and AArch64*, Arm ABI documents).
//!
//! The existing crates offer files that can panic, which this image must not.

use core::ffi::CStr;

use cortex_m_semihosting::debug::{self, EXIT_FAILURE, EXIT_SUCCESS};
use cortex_m_semihosting::{nr, syscall};

/// The host is gone, or uses another protocol version.
pub(crate) struct End;

/// Modes of `SYS_OPEN`: those of `fopen`, numbered.
const READ_BINARY: usize = 1;
const WRITE_BINARY: usize = 5;

/// An open file of the host. Closed by the host when the emulation ends.
pub(crate) struct File(usize);

impl File {
    /// Opens a file for reading; blocks on a FIFO until it has a writer.
    pub(crate) fn open(path: &CStr) -> Result<Self, End> {
        Self::with_mode(path, READ_BINARY)
    }

    /// Opens a file for writing; blocks on a FIFO until it has a reader.
    pub(crate) fn create(path: &CStr) -> Result<Self, End> {
        Self::with_mode(path, WRITE_BINARY)
    }

    fn with_mode(path: &CStr, mode: usize) -> Result<Self, End> {
        let block = [path.as_ptr() as usize, mode, path.count_bytes()];
        // SAFETY: SYS_OPEN takes the address of a zero-terminated name, the mode and the length of the name, and only
        // reads them.
        match unsafe { syscall(nr::OPEN, &block) } {
            usize::MAX => Err(End),
            handle => Ok(Self(handle)),
        }
    }

    /// Fills `buffer`; blocks until that many bytes have arrived.
    pub(crate) fn read(&self, buffer: &mut [u8]) -> Result<(), End> {
        let mut rest = buffer;
        while !rest.is_empty() {
            let block = [self.0, rest.as_mut_ptr() as usize, rest.len()];
            // SAFETY: SYS_READ writes at most `len` bytes to the address, which is that of `rest`.
            let missing = unsafe { syscall(nr::READ, &block) };
            let read = rest.len().checked_sub(missing).ok_or(End)?;
            if read == 0 {
                return Err(End);
            }
            rest = rest.get_mut(read..).ok_or(End)?;
        }
        Ok(())
    }

    /// Writes all of `bytes`.
    pub(crate) fn write(&self, bytes: &[u8]) -> Result<(), End> {
        let block = [self.0, bytes.as_ptr() as usize, bytes.len()];
        // SAFETY: SYS_WRITE reads `len` bytes from the address, which is that of `bytes`.
        match unsafe { syscall(nr::WRITE, &block) } {
            0 => Ok(()),
            _ => Err(End),
        }
    }
}

/// Ends the emulation; the emulator's exit status is 0 or 1.
pub(crate) fn exit(result: Result<(), End>) -> ! {
    debug::exit(match result {
        Ok(()) => EXIT_SUCCESS,
        Err(End) => EXIT_FAILURE,
    });
    // Reached only if a debugger lets the program continue.
    loop {
        cortex_m::asm::wfi();
    }
}
