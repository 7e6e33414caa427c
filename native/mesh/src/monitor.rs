//! How a long computation says where it is and hears that it should stop.

use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};

/// The caller wants the computation to stop.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error("cancelled by the caller")]
pub struct Cancelled;

/// Shared between a computation and whoever waits for it. The computation calls [`Monitor::stage`], and
/// [`Monitor::check`] at least every 50 ms; the waiting side polls [`Monitor::progress`] and may [`Monitor::cancel`].
#[derive(Debug, Default)]
pub struct Monitor {
    cancelled: AtomicBool,
    stage: Mutex<&'static str>,
    fraction: AtomicU64,
}

impl Monitor {
    /// A monitor nobody has cancelled.
    pub fn new() -> Self {
        Self::default()
    }

    /// Asks the computation to stop.
    pub fn cancel(&self) {
        self.cancelled.store(true, Ordering::Relaxed);
    }

    /// True once cancelled.
    pub fn is_cancelled(&self) -> bool {
        self.cancelled.load(Ordering::Relaxed)
    }

    /// `Err` once cancelled. One relaxed load: call it in inner loops.
    ///
    /// # Errors
    /// [`Cancelled`].
    pub fn check(&self) -> Result<(), Cancelled> {
        if self.is_cancelled() { Err(Cancelled) } else { Ok(()) }
    }

    /// Enters a stage; `fraction` of the whole job lies behind.
    ///
    /// # Errors
    /// [`Cancelled`].
    pub fn stage(&self, name: &'static str, fraction: f64) -> Result<(), Cancelled> {
        *self.stage.lock().unwrap_or_else(std::sync::PoisonError::into_inner) = name;
        self.fraction.store(fraction.to_bits(), Ordering::Relaxed);
        self.check()
    }

    /// Current stage and the fraction of the job that lies behind.
    pub fn progress(&self) -> (&'static str, f64) {
        let stage = *self.stage.lock().unwrap_or_else(std::sync::PoisonError::into_inner);
        (stage, f64::from_bits(self.fraction.load(Ordering::Relaxed)))
    }
}
