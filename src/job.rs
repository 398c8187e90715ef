//! What a long computation is allowed to use and how it talks to its caller: threads, memory budget, progress, cancel.
//!
//! A [`Job`] is handed down by reference and never stored globally. Work runs on a thread pool that lives as long as
//! [`Job::run`]; the caller's progress function is called on the caller's own thread only.

use crate::error::{Error, Result};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU32, AtomicU64, Ordering};
use std::time::Duration;

/// The stages of the work, in the order in which they run. The numbers are part of the C interface.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[repr(u32)]
pub enum Stage {
    /// Reading and checking the mesh.
    Mesh = 0,
    /// Refining the analysis surface.
    Surface = 1,
    /// D2: shooting rays.
    Thickness = 2,
    /// Factoring the Laplacian of the heat method.
    Factor = 3,
    /// D1: solving for geodesic distances.
    Geodesic = 4,
    /// Partition into features.
    Segment = 5,
}

impl Stage {
    /// Number of stages.
    pub const COUNT: usize = 6;

    /// The stage's name, as shown beside a progress bar.
    pub fn name(self) -> &'static str {
        ["mesh", "surface", "thickness", "factor", "geodesic", "segment"][self as usize]
    }

    fn from_u32(v: u32) -> Stage {
        use Stage::*;
        [Mesh, Surface, Thickness, Factor, Geodesic, Segment][v.min(5) as usize]
    }
}

/// A flag that any thread may raise to stop a job.
#[derive(Debug, Clone, Default)]
pub struct CancelToken(Arc<AtomicBool>);

impl CancelToken {
    /// Asks every job that holds this token to stop.
    pub fn cancel(&self) {
        self.0.store(true, Ordering::Relaxed);
    }
    /// Lowers the flag, for use with another job.
    pub fn reset(&self) {
        self.0.store(false, Ordering::Relaxed);
    }
    /// True after [`CancelToken::cancel`].
    pub fn is_cancelled(&self) -> bool {
        self.0.load(Ordering::Relaxed)
    }
}

/// Called on the caller's thread with the overall fraction (0..1, never falling) and the stage; `false` cancels.
pub type Progress<'a> = &'a mut dyn FnMut(f64, Stage) -> bool;

/// The limits of one computation and its state.
#[derive(Debug, Default)]
pub struct Job {
    threads: usize,
    budget: Option<u64>,
    cancel: CancelToken,
    stopped: AtomicBool,
    stage: AtomicU32,
    /// Overall fraction before the current stage and the share of the stage, as f64 bits.
    span: [AtomicU64; 2],
    done: AtomicU64,
    total: AtomicU64,
}

impl Job {
    /// A job on `threads` threads (0 = all cores) that may use about `budget` bytes (None = no limit).
    pub fn new(threads: usize, budget: Option<u64>, cancel: CancelToken) -> Job {
        Job { threads, budget, cancel, ..Job::default() }
    }

    /// Number of worker threads that [`Job::run`] starts.
    pub fn threads(&self) -> usize {
        match self.threads {
            0 => std::thread::available_parallelism().map_or(1, |n| n.get()),
            n => n,
        }
    }

    /// Enters `stage`, which covers the overall fractions `from..to` in `units` calls' worth of [`Job::advance`].
    pub fn begin(&self, stage: Stage, from: f64, to: f64, units: u64) -> Result<()> {
        self.stage.store(stage as u32, Ordering::Relaxed);
        self.done.store(0, Ordering::Relaxed);
        self.total.store(units.max(1), Ordering::Relaxed);
        self.span[0].store(from.to_bits(), Ordering::Relaxed);
        self.span[1].store((to - from).to_bits(), Ordering::Relaxed);
        self.check()
    }

    /// Reports `units` of the stage as done; fails with [`Error::Cancelled`] when the caller wants out. Cheap: call it
    /// every millisecond or so of work, from any thread.
    pub fn advance(&self, units: u64) -> Result<()> {
        self.done.fetch_add(units, Ordering::Relaxed);
        self.check()
    }

    /// Fails with [`Error::Cancelled`] when the caller wants out.
    pub fn check(&self) -> Result<()> {
        if self.stopped.load(Ordering::Relaxed) || self.cancel.is_cancelled() { Err(Error::Cancelled) } else { Ok(()) }
    }

    /// Refuses with [`Error::Budget`] if `bytes`, the peak of the step named `what`, is over the job's budget.
    pub fn afford(&self, bytes: u64, what: &str) -> Result<()> {
        match self.budget {
            Some(limit) if bytes > limit => {
                Err(Error::Budget(format!("{what} needs about {bytes} bytes, the budget is {limit} bytes")))
            }
            _ => Ok(()),
        }
    }

    fn fraction(&self) -> f64 {
        let [from, share] = [0, 1].map(|k| f64::from_bits(self.span[k].load(Ordering::Relaxed)));
        let part = self.done.load(Ordering::Relaxed) as f64 / self.total.load(Ordering::Relaxed).max(1) as f64;
        (from + share * part.min(1.0)).clamp(0.0, 1.0)
    }

    /// Runs `work` on a pool of this job's own and returns when it and all its threads have ended. `progress` is called
    /// on this thread, some 30 times a second. A panic of the work comes out of this call.
    pub fn run<T: Send>(&self, progress: Option<Progress<'_>>, work: impl FnOnce() -> Result<T> + Send) -> Result<T> {
        self.check()?;
        let mut report = Reporter { progress, last: 0.0 };
        report.call(self, 0.0);
        self.check()?;
        let pooled = || {
            rayon::ThreadPoolBuilder::new()
                .num_threads(self.threads())
                .build_scoped(|thread| thread.run(), |pool| pool.install(work))
                .map_err(|e| Error::NoMemory(format!("could not start the worker threads: {e}")))?
        };
        let result = std::thread::scope(|scope| {
            let caller = std::thread::current();
            let worker = std::thread::Builder::new()
                .spawn_scoped(scope, move || {
                    let _wake = Wake(caller);
                    pooled()
                })
                .map_err(|e| Error::NoMemory(format!("could not start the worker threads: {e}")))?;
            while !worker.is_finished() {
                std::thread::park_timeout(Duration::from_millis(30));
                report.call(self, self.fraction());
            }
            worker.join().unwrap_or_else(|panic| std::panic::resume_unwind(panic))
        })?;
        self.check()?;
        report.call(self, 1.0);
        self.check()?;
        Ok(result)
    }
}

/// Wakes the thread that waits for the work, also when the work panics.
struct Wake(std::thread::Thread);

impl Drop for Wake {
    fn drop(&mut self) {
        self.0.unpark();
    }
}

/// Keeps the reported fraction from falling.
struct Reporter<'a> {
    progress: Option<Progress<'a>>,
    last: f64,
}

impl Reporter<'_> {
    fn call(&mut self, job: &Job, fraction: f64) {
        self.last = self.last.max(fraction);
        // who said stop is not asked again
        if job.stopped.load(Ordering::Relaxed) {
            return;
        }
        if let Some(progress) = &mut self.progress {
            if !progress(self.last, Stage::from_u32(job.stage.load(Ordering::Relaxed))) {
                job.stopped.store(true, Ordering::Relaxed);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn progress_rises_and_ends_at_one() {
        let job = Job::new(2, None, CancelToken::default());
        let mut seen = Vec::new();
        let out = job.run(
            Some(&mut |f, s| {
                seen.push((f, s));
                true
            }),
            || {
                job.begin(Stage::Thickness, 0.0, 0.5, 4)?;
                for _ in 0..4 {
                    std::thread::sleep(Duration::from_millis(40));
                    job.advance(1)?;
                }
                job.begin(Stage::Geodesic, 0.5, 1.0, 1)?;
                job.advance(1)?;
                Ok(7)
            },
        );
        assert_eq!(out, Ok(7));
        assert!(seen.windows(2).all(|w| w[0].0 <= w[1].0), "{seen:?}");
        assert!(seen.len() > 3 && seen.last().unwrap().0 == 1.0, "{seen:?}");
    }

    #[test]
    fn a_progress_function_that_says_no_cancels() {
        let job = Job::new(1, None, CancelToken::default());
        let out = job.run(Some(&mut |f, _| f < 0.3), || {
            job.begin(Stage::Geodesic, 0.0, 1.0, 1000)?;
            loop {
                std::thread::sleep(Duration::from_millis(1));
                job.advance(10)?;
            }
            #[allow(unreachable_code)]
            Ok(())
        });
        assert_eq!(out, Err(Error::Cancelled));
    }

    #[test]
    fn a_token_cancels_from_another_thread() {
        let token = CancelToken::default();
        let job = Job::new(1, None, token.clone());
        token.cancel();
        assert_eq!(job.run(None, || Ok(1)), Err(Error::Cancelled));
    }

    #[test]
    fn a_panic_of_the_work_reaches_the_caller() {
        let job = Job::new(2, None, CancelToken::default());
        let caught = std::panic::catch_unwind(std::panic::AssertUnwindSafe(|| {
            job.run::<()>(None, || panic!("boom")).ok();
        }));
        assert!(caught.is_err());
    }
}
