//! Cases on threads: small ones one to a thread, large ones on all, within a bound of memory.
//!
//! Long cases come first, so that none is left at the end. A case gets all threads if on one it would outlast all others that are left: then
//! nothing else could keep the threads busy. Results go to one place as they come, in any order.

use std::{
    collections::VecDeque,
    path::PathBuf,
    sync::{
        Condvar, Mutex, MutexGuard, PoisonError,
        atomic::{AtomicBool, AtomicUsize, Ordering},
        mpsc,
    },
    time::{Duration, Instant},
};

use rayon::{ThreadPool, ThreadPoolBuilder};

use super::{
    SweepError,
    journal::{Entry, State},
    plan::Plan,
};
use crate::{
    advice::{Advised, codes},
    measuring::Measuring,
    recording::Destination,
    session::{self, Flow, Recording, RunError, Source, Status},
    simulation::Simulation,
    view::View,
};

#[derive(Clone, Debug)]
pub struct Job {
    pub number: usize,
    /// Where its recording goes, if it is kept, and its name in the journal.
    pub recording: Option<(PathBuf, String)>,
}

/// What cases may take.
#[derive(Clone, Copy, Debug)]
pub struct Limits {
    /// Threads, of all cases together.
    pub threads: usize,
    /// Estimated memory, of all cases together \[bytes\].
    pub memory: u64,
}

/// One-thread time up to which a case stays on one thread \[s\]: threads that share less wait for each other.
const SMALL: f64 = 1.0;

/// Time between looks at the signal where a thread waits for others.
const PATIENCE: Duration = Duration::from_millis(100);

/// Computes cases.
///
/// * `signal`: not 0 once the sweep is to be interrupted
/// * `take`: gets what the journal says of every case that is done, on this thread; with an error the sweep ends
pub fn run(
    plan: &Plan,
    jobs: Vec<Job>,
    limits: Limits,
    signal: &AtomicUsize,
    mut take: impl FnMut(Entry) -> Result<(), SweepError>,
) -> Result<(), SweepError> {
    let queue = Queue::new(plan, jobs, limits, signal);
    let (sender, receiver) = mpsc::channel();
    std::thread::scope(|scope| {
        for _ in 0..limits.threads {
            let (sender, queue) = (sender.clone(), &queue);
            scope.spawn(move || work(queue, &sender));
        }
        drop(sender);
        let mut result = Ok(());
        for done in receiver {
            if result.is_ok() {
                result = done.and_then(&mut take);
                if result.is_err() {
                    queue.break_off();
                }
            }
        }
        result
    })
}

/// Cases that wait, and what those under way leave free.
struct Queue<'a> {
    plan: &'a Plan,
    limits: Limits,
    signal: &'a AtomicUsize,
    is_broken: AtomicBool,
    waiting: Mutex<Waiting>,
    changed: Condvar,
}

struct Waiting {
    jobs: VecDeque<Job>,
    /// Estimated time of all jobs on one thread \[s\].
    seconds: f64,
    free: Limits,
}

impl<'a> Queue<'a> {
    fn new(plan: &'a Plan, mut jobs: Vec<Job>, limits: Limits, signal: &'a AtomicUsize) -> Self {
        let seconds = |job: &Job| plan.cases[job.number - 1].seconds;
        jobs.sort_by(|a, b| seconds(b).total_cmp(&seconds(a)));
        let waiting = Waiting { seconds: jobs.iter().map(seconds).sum(), jobs: jobs.into(), free: limits };
        let (waiting, changed) = (Mutex::new(waiting), Condvar::new());
        Self { plan, limits, signal, is_broken: AtomicBool::new(false), waiting, changed }
    }

    fn is_over(&self) -> bool {
        self.signal.load(Ordering::Relaxed) != 0 || self.is_broken.load(Ordering::Relaxed)
    }

    fn break_off(&self) {
        self.is_broken.store(true, Ordering::Relaxed);
        self.changed.notify_all();
    }

    fn lock(&self) -> MutexGuard<'_, Waiting> {
        self.waiting.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// The next job, once there is room for it; `None` when nothing is left to do.
    fn next(&self) -> Option<(Job, Limits)> {
        let mut waiting = self.lock();
        while !self.is_over() {
            let planned = self.plan.cases[waiting.jobs.front()?.number - 1];
            let is_large = planned.seconds > SMALL.max(waiting.seconds / self.limits.threads as f64);
            let threads = if is_large { self.limits.threads } else { 1 };
            let share = Limits { threads, memory: planned.memory.min(self.limits.memory) };
            if share.threads <= waiting.free.threads && share.memory <= waiting.free.memory {
                waiting.free.threads -= share.threads;
                waiting.free.memory -= share.memory;
                waiting.seconds -= planned.seconds;
                return waiting.jobs.pop_front().map(|job| (job, share));
            }
            waiting = self.changed.wait_timeout(waiting, PATIENCE).unwrap_or_else(PoisonError::into_inner).0;
        }
        None
    }

    fn give_back(&self, share: Limits) {
        let mut waiting = self.lock();
        waiting.free.threads += share.threads;
        waiting.free.memory += share.memory;
        self.changed.notify_all();
    }

    /// Computes a case; `None` if it was interrupted.
    fn compute(&self, job: &Job, pool: &ThreadPool) -> Result<Option<Entry>, SweepError> {
        let (number, start) = (job.number, Instant::now());
        let case = self.plan.case(number).map_err(|error| {
            SweepError::Failed(format!("case {number} has changed since the sweep began: {error}"))
        })?;
        let mut watch = |_: &View<'_>| match self.is_over() {
            true => Flow::Interrupt("the sweep is interrupted".into()),
            false => Flow::Continue,
        };
        let mut steps = pool.install(|| Advised::new(&case, Simulation::new(&case)));
        let computed = pool.install(|| {
            let Some((path, _)) = &job.recording else {
                let mut measuring = Measuring::new(case.units(), true);
                let mut measure = |view: &View<'_>| measuring.take(view);
                let outcome = session::run(&mut steps, &mut [&mut measure, &mut watch])?;
                let measures = measuring.measures(&outcome.validity);
                return Ok((outcome, measures));
            };
            // overwrite what a stopped attempt left
            let destination = Destination { overwrite: true, ..Destination::new(path) };
            let mut recording = Recording::create(&destination, &case, Source::Simulation)?;
            let outcome = session::run(&mut steps, &mut [&mut recording, &mut watch])?;
            let measures = recording.measures(&outcome.validity);
            Ok((outcome, measures))
        });
        let entry = |state, message, file, measures| Entry {
            case: number,
            digest: self.plan.cases[number - 1].digest,
            state,
            message,
            file,
            seconds: start.elapsed().as_secs_f64(),
            host: gethostname::gethostname().to_string_lossy().into_owned(),
            measures,
            warnings: codes(steps.findings()).into_iter().map(str::to_owned).collect(),
        };
        let file = job.recording.as_ref().map(|(_, name)| name.clone());
        match computed {
            Ok((outcome, measures)) => {
                let state = match outcome.status {
                    Status::Completed => State::Completed,
                    Status::Stopped(_) => State::Stopped,
                    Status::Interrupted(_) | Status::Failed(_) => return Ok(None),
                };
                Ok(Some(entry(state, None, file, measures.into())))
            }
            Err(RunError::Simulation(error)) => {
                Ok(Some(entry(State::Failed, Some(error.to_string()), None, Default::default())))
            }
            Err(error) => Err(error.into()),
        }
    }
}

/// One thread's part of the work.
fn work(queue: &Queue<'_>, sender: &mpsc::Sender<Result<Entry, SweepError>>) {
    let pool = |builder: ThreadPoolBuilder| {
        builder.build().map_err(|error| SweepError::Failed(format!("cannot start threads: {error}")))
    };
    // the thread itself is the pool of small cases
    let own = match pool(ThreadPoolBuilder::new().num_threads(1).use_current_thread()) {
        Ok(own) => own,
        Err(error) => return drop(sender.send(Err(error))),
    };
    while let Some((job, share)) = queue.next() {
        let done = match share.threads {
            1 => queue.compute(&job, &own),
            threads => pool(ThreadPoolBuilder::new().num_threads(threads))
                .and_then(|pool| queue.compute(&job, &pool)),
        };
        queue.give_back(share);
        // no results are taken after the sweep has ended
        if let Some(done) = done.transpose() {
            drop(sender.send(done));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sweep::{
        request::{Keep, Request},
        spec::Vary,
    };

    fn plan(vary: &str) -> Plan {
        let request = Request {
            case: "fig5".into(),
            set: vec!["record.frames=0".into()],
            keep: Keep::None,
            vary: vec![Vary::parse(vary)],
            ..Request::default()
        };
        Plan::new(request, "".as_ref()).expect("a plan")
    }

    fn jobs(plan: &Plan) -> Vec<Job> {
        (1..=plan.cases.len()).map(|number| Job { number, recording: None }).collect()
    }

    /// True if the next job has to wait until `share` is given back.
    fn waits(queue: &Queue<'_>, share: Limits) -> bool {
        std::thread::scope(|scope| {
            let next = scope.spawn(|| queue.next());
            std::thread::sleep(3 * PATIENCE);
            let waits = !next.is_finished();
            queue.give_back(share);
            assert!(next.join().expect("no panic").is_some());
            waits
        })
    }

    #[test]
    fn cases_wait_for_memory() {
        let plan = plan("indenter.mass=1,2");
        let memory = plan.cases[0].memory;
        let signal = AtomicUsize::new(0);
        for (room, is_short) in [(2 * memory - 1, true), (2 * memory, false)] {
            let queue = Queue::new(&plan, jobs(&plan), Limits { threads: 2, memory: room }, &signal);
            let (_, share) = queue.next().expect("a job");
            assert_eq!(share.threads, 1);
            assert_eq!(waits(&queue, share), is_short, "{room}");
        }
    }

    #[test]
    fn a_case_that_would_outlast_all_others_has_all_threads() {
        let mut plan = plan("indenter.mass=1,2,3,4");
        let signal = AtomicUsize::new(0);
        let limits = Limits { threads: 4, memory: u64::MAX };
        let shares = |plan: &Plan| {
            let queue = Queue::new(plan, jobs(plan), limits, &signal);
            let next = || {
                let (job, share) = queue.next().expect("a job");
                queue.give_back(share);
                (job.number, share.threads)
            };
            [(); 4].map(|()| next())
        };
        // small ones, however they differ
        assert_eq!(shares(&plan).map(|(_, threads)| threads), [1; 4]);
        let seconds = [2.0, 9.0, 1.5, 1.5];
        plan.cases.iter_mut().zip(seconds).for_each(|(case, seconds)| case.seconds = seconds);
        // 9 of 14 s on 4 threads; then 2 of 5, 1.5 of 3, 1.5 of 1.5
        assert_eq!(shares(&plan), [(2, 4), (1, 4), (3, 4), (4, 4)]);
        plan.cases.iter_mut().for_each(|case| case.seconds = 2.0);
        assert_eq!(shares(&plan).map(|(_, threads)| threads), [1, 4, 4, 4]);
    }
}
