//! One way to run a long computation: on its own thread, with the interpreter free, progress reported, Ctrl-C heard and
//! panics caught.

use crate::errors::{self, Cancelled, InternalError};
use mesh::Monitor;
use pyo3::prelude::*;
use std::sync::Arc;
use std::sync::mpsc::{RecvTimeoutError, sync_channel};
use std::time::Duration;

/// How often the waiting thread looks at `progress` and at signals.
const TICK: Duration = Duration::from_millis(40);

/// Runs `job` and waits for it with the interpreter released. Every [`TICK`] it calls `progress(stage, fraction)` and
/// handles signals; a false answer, an exception or Ctrl-C cancels through the monitor, and the job's thread has ended
/// when this returns.
///
/// # Errors
/// `Cancelled`, the exception that `progress` or a signal handler raised, or `InternalError` when the job panicked.
pub fn run<T: Send + 'static>(
    py: Python<'_>,
    progress: Option<&Bound<'_, PyAny>>,
    job: impl FnOnce(&Monitor) -> T + Send + 'static,
) -> PyResult<T> {
    let monitor = Arc::new(Monitor::new());
    listen(py, progress, "start", 0.0)?;
    let (sender, mut receiver) = sync_channel(1);
    let worker = std::thread::Builder::new().name("quadloom".to_owned()).spawn({
        let monitor = Arc::clone(&monitor);
        move || {
            let result = job(&monitor);
            // The receiver outlives this thread, and the channel has room.
            let _ = sender.send(result);
        }
    })?;
    let mut stopped = None;
    let outcome = loop {
        // A receiver may be lent to the detached closure, but not shared with it.
        let inbox = &mut receiver;
        match py.detach(move || inbox.recv_timeout(TICK)) {
            Ok(result) => break Some(result),
            Err(RecvTimeoutError::Timeout) if stopped.is_none() => {
                let (stage, fraction) = monitor.progress();
                if let Err(reason) = listen(py, progress, stage, fraction) {
                    monitor.cancel();
                    stopped = Some(reason);
                }
            }
            Err(RecvTimeoutError::Timeout) => {}
            Err(RecvTimeoutError::Disconnected) => break None,
        }
    };
    let panic = py.detach(|| worker.join()).err();
    if let Some(reason) = stopped {
        return Err(reason);
    }
    outcome.ok_or_else(|| {
        let stage = monitor.progress().0;
        let cause = panic.as_deref().map_or("no message", panic_message);
        errors::raise_plain::<InternalError>(
            py,
            "internal",
            format!("internal error at the stage \"{stage}\": {cause}; please report it with the input"),
        )
    })
}

/// Signals first, then the caller's `progress`; `Err` when either wants to stop.
fn listen(py: Python<'_>, progress: Option<&Bound<'_, PyAny>>, stage: &str, fraction: f64) -> PyResult<()> {
    py.check_signals()?;
    let Some(progress) = progress else { return Ok(()) };
    let answer = progress.call1((stage, fraction))?;
    if answer.is_none() || answer.is_truthy()? { Ok(()) } else { Err(cancelled(py)) }
}

/// The exception for a computation that stopped because it was asked to.
pub fn cancelled(py: Python<'_>) -> PyErr {
    errors::raise_plain::<Cancelled>(py, "cancelled", mesh::Cancelled.to_string())
}

fn panic_message(payload: &(dyn std::any::Any + Send)) -> &str {
    match (payload.downcast_ref::<&str>(), payload.downcast_ref::<String>()) {
        (Some(text), _) => text,
        (_, Some(text)) => text,
        _ => "no message",
    }
}
