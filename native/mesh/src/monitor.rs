//! How a long computation says where it is and hears that it should stop.

use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::{Arc, Mutex};

/// The caller wants the computation to stop.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error("cancelled by the caller")]
pub struct Cancelled;

/// Shared between a computation and whoever waits for it. The computation calls [`Monitor::stage`], and
/// [`Monitor::check`] at least every 50 ms; the waiting side polls [`Monitor::progress`] and may [`Monitor::cancel`].
#[derive(Debug, Default)]
pub struct Monitor {
    cancelled: Arc<AtomicBool>,
    stage: Mutex<Stage>,
    fraction: AtomicU64,
}

/// What is being done, and the part of the whole job that the fractions of stages are counted in.
#[derive(Debug)]
struct Stage {
    name: &'static str,
    span: (f64, f64),
}

impl Default for Stage {
    fn default() -> Self {
        Self { name: "", span: (0.0, 1.0) }
    }
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
        let mut stage = self.lock();
        stage.name = name;
        let (low, high) = stage.span;
        self.fraction.store((low + (high - low) * fraction).to_bits(), Ordering::Relaxed);
        drop(stage);
        self.check()
    }

    /// Runs a part of a job that counts its own fractions from 0 to 1: they become those from `low` to `high` of the whole.
    pub fn within<T>(&self, low: f64, high: f64, part: impl FnOnce() -> T) -> T {
        let outer = self.lock().span;
        let inside = |fraction: f64| outer.0 + (outer.1 - outer.0) * fraction;
        self.lock().span = (inside(low), inside(high));
        let made = part();
        self.lock().span = outer;
        made
    }

    /// A monitor for one of several parts of a job that run at the same time: it is cancelled with this one, and nobody sees where it is.
    #[must_use]
    pub fn aside(&self) -> Self {
        Self { cancelled: Arc::clone(&self.cancelled), ..Self::default() }
    }

    fn lock(&self) -> std::sync::MutexGuard<'_, Stage> {
        self.stage.lock().unwrap_or_else(std::sync::PoisonError::into_inner)
    }

    /// Current stage and the fraction of the job that lies behind.
    pub fn progress(&self) -> (&'static str, f64) {
        let stage = self.lock().name;
        (stage, f64::from_bits(self.fraction.load(Ordering::Relaxed)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_monitor_aside_is_cancelled_with_the_other() {
        let monitor = Monitor::new();
        let aside = monitor.aside();
        assert_eq!(aside.stage("part", 0.5), Ok(()));
        assert_eq!(monitor.progress(), ("", 0.0));
        monitor.cancel();
        assert_eq!(aside.check(), Err(Cancelled));
    }

    #[test]
    fn fractions_of_a_part_are_fractions_of_the_whole() {
        let monitor = Monitor::new();
        monitor.within(0.2, 0.6, || {
            assert_eq!(monitor.stage("part", 0.5), Ok(()));
            monitor.within(0.5, 1.0, || assert_eq!(monitor.stage("part of a part", 1.0), Ok(())));
        });
        assert_eq!(monitor.progress(), ("part of a part", 0.6));
        assert_eq!(monitor.stage("whole", 0.7), Ok(()));
        assert_eq!(monitor.progress(), ("whole", 0.7));
    }
}
