//! Runs a solver that offers no way to interrupt it so that the caller can still cancel.
//!
//! The safe interfaces of `HiGHS` and mwmatching take no callback. The job therefore owns all its data and runs on a
//! thread of its own, while the calling thread polls `cancelled`. A cancelled job is left behind: it shares nothing with
//! anyone, ends at its own limits, and its result is dropped.
//!
//! How long a job may live on unseen: `HiGHS` for its time limit ([`crate::integer::Options::time_limit`]); it is asked for
//! eight free counts at most by the boolean, which take milliseconds. A matching to its end: seconds for the largest
//! regions (see the measurement beside [`crate::matching`]). The process may end meanwhile.

use std::sync::mpsc::{RecvTimeoutError, sync_channel};
use std::thread::Builder;
use std::time::Duration;

use crate::{CancelCheck, SolveError};

/// How often `cancelled` is asked.
const POLL: Duration = Duration::from_millis(20);

/// Stack of the job's thread in bytes: branch and bound recurses deeper than Rust's default of 2 MiB is sure to hold.
const STACK: usize = 16 << 20;

/// Runs `job` on a thread of its own and returns its result, or leaves it behind within 20 ms of `cancelled` returning true.
///
/// # Errors
/// [`SolveError::Cancelled`]; [`SolveError::Solver`] with the name `solver` when the job panics.
pub fn run<T: Send + 'static>(
    solver: &'static str,
    cancelled: CancelCheck<'_>,
    job: impl FnOnce() -> T + Send + 'static,
) -> Result<T, SolveError> {
    if cancelled() {
        return Err(SolveError::Cancelled);
    }
    let failed = |message: String| SolveError::Solver { solver, message };
    let (sender, receiver) = sync_channel(1);
    let body = move || {
        // A failed send means that the caller has left: there is nobody to tell.
        let _ = sender.send(job());
    };
    let thread = Builder::new()
        .name(format!("quadloom {solver}"))
        .stack_size(STACK)
        .spawn(body)
        .map_err(|error| failed(format!("its thread did not start: {error}")))?;
    loop {
        match receiver.recv_timeout(POLL) {
            Ok(result) => return Ok(result),
            Err(RecvTimeoutError::Timeout) if cancelled() => return Err(SolveError::Cancelled),
            Err(RecvTimeoutError::Timeout) => {}
            Err(RecvTimeoutError::Disconnected) => {
                let panic = thread.join().err();
                let text = panic.as_ref().and_then(|payload| {
                    payload
                        .downcast_ref::<String>()
                        .cloned()
                        .or_else(|| payload.downcast_ref::<&str>().map(ToString::to_string))
                });
                return Err(failed(text.unwrap_or_else(|| "it panicked".into())));
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use std::time::Instant;

    use super::*;

    #[test]
    fn a_panic_is_an_error() {
        let error = run("test", &|| false, || assert_eq!(1, 2, "arithmetic")).unwrap_err();
        assert!(matches!(error, SolveError::Solver { message, .. } if message.contains("arithmetic")));
    }

    #[test]
    fn cancel_does_not_wait_for_the_job() {
        let start = Instant::now();
        let cancelled = || start.elapsed() > Duration::from_millis(60);
        let result = run("test", &cancelled, || {
            std::thread::sleep(Duration::from_secs(5));
        });
        assert_eq!(result, Err(SolveError::Cancelled));
        assert!(start.elapsed() < Duration::from_secs(1));
    }
}
