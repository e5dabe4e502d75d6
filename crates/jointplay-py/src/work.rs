//! The core's work, done without the interpreter's lock on threads of our own.
//!
//! The caller waits and looks after signals meanwhile: what a handler raises, such as `KeyboardInterrupt`, stops the work.
//! A process that was forked has none of its parent's threads and gets new ones. Where no thread can be started, the
//! caller works alone.

use std::any::Any;
use std::cell::{Cell, RefCell};
use std::env;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::process;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{RecvTimeoutError, channel};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread;
use std::time::{Duration, Instant};

use jointplay_core::interrupt::{self, Stopped};
use pyo3::exceptions::{PyKeyboardInterrupt, PyRuntimeError};
use pyo3::intern;
use pyo3::prelude::*;
use rayon::{ThreadPool, ThreadPoolBuilder};

/// Between two looks at signals.
const LOOK: Duration = Duration::from_millis(50);
/// Of every thread, as the main thread of a process usually has it; only what is used takes memory.
const STACK: usize = 8 << 20;

/// Whether the work of Python's main thread, which alone gets signals, is to stop.
static STOP: AtomicBool = AtomicBool::new(false);
/// Locked with the interpreter's lock held and for no longer than that, so that a fork never finds it locked.
static POOLS: Mutex<Pools> = Mutex::new(Pools { process: 0, of_main: None, of_others: None, others: 0 });

/// Threads that wait for the next work: as many as there are cores.
struct Pools {
    process: u32,
    of_main: Option<Arc<ThreadPool>>,
    /// Shared by all other threads of Python.
    of_others: Option<Arc<ThreadPool>>,
    /// How many these are, 0 for all cores.
    others: usize,
}

impl Pools {
    /// Those of this process.
    fn own(&mut self) -> &mut Self {
        if self.process != process::id() {
            // The threads of the parent are not here: they cannot be ended either.
            std::mem::forget((self.of_main.take(), self.of_others.take()));
            self.process = process::id();
        }
        self
    }

    fn kept(&mut self, is_main: bool) -> Option<Arc<ThreadPool>> {
        let pool = if is_main { &mut self.of_main } else { &mut self.of_others };
        if pool.is_none() {
            *pool = start(if is_main { 0 } else { self.others }, is_main).map(Arc::new);
        }
        pool.clone()
    }
}

/// All threads of Python but the main one share so many threads from now on, 0 for all cores. A process that is one of
/// several on a machine keeps to its part of the cores by this.
#[pyfunction]
pub fn share_threads(count: usize) {
    let mut pools = POOLS.lock().unwrap_or_else(PoisonError::into_inner);
    let pools = pools.own();
    if pools.others != count {
        pools.others = count;
        // Work that goes on keeps the threads that it has.
        pools.of_others = None;
    }
}

/// How many threads there are if nothing else is said: what the environment asks for, as of every program with rayon, else
/// one for each core.
fn cores() -> usize {
    let asked = env::var("RAYON_NUM_THREADS").ok().and_then(|count| count.parse().ok()).filter(|count| *count > 0);
    asked.unwrap_or_else(|| thread::available_parallelism().map_or(1, usize::from))
}

/// So many threads, 0 for all cores, or as many as can be started; `None` where none can.
fn start(threads: usize, is_main: bool) -> Option<ThreadPool> {
    let mut count = if threads == 0 { cores() } else { threads };
    while count > 0 {
        let listen = move |_| interrupt::listen(is_main.then_some(|| STOP.load(Ordering::Relaxed)));
        let pool = ThreadPoolBuilder::new().num_threads(count).stack_size(STACK).start_handler(listen).build();
        if pool.is_ok() {
            return pool.ok();
        }
        count /= 2;
    }
    None
}

/// What the core gives, unless a signal stops it.
pub fn work<T: Send>(py: Python<'_>, task: impl FnOnce() -> T + Send) -> PyResult<T> {
    match done(py, 0, task) {
        (_, Some(signal)) => Err(signal),
        (found, None) => found,
    }
}

/// The same on so many threads, 0 for all cores. What the core gives although Ctrl-C has stopped it is given, too,
/// where there is anything in it.
pub fn work_in_part<T: Send>(
    py: Python<'_>,
    threads: usize,
    task: impl FnOnce() -> T + Send,
    is_empty: impl FnOnce(&T) -> bool,
) -> PyResult<T> {
    match done(py, threads, task) {
        (Ok(found), Some(signal)) if signal.is_instance_of::<PyKeyboardInterrupt>(py) && !is_empty(&found) => Ok(found),
        (_, Some(signal)) => Err(signal),
        (found, None) => found,
    }
}

/// What short work gives that needs no threads.
pub fn short<T>(task: impl FnOnce() -> T) -> PyResult<T> {
    catch_unwind(AssertUnwindSafe(task)).map_err(|panic| defect(panic.as_ref()))
}

/// What the work gives, and what a handler of a signal has raised meanwhile.
fn done<T: Send>(py: Python<'_>, threads: usize, task: impl FnOnce() -> T + Send) -> (PyResult<T>, Option<PyErr>) {
    let is_main = match is_main_thread(py) {
        Ok(is_main) => is_main,
        Err(error) => return (Err(error), None),
    };
    let pool = if threads == 0 {
        // Nothing panics while this is locked.
        POOLS.lock().unwrap_or_else(PoisonError::into_inner).own().kept(is_main)
    } else {
        start(threads, is_main).map(Arc::new)
    };
    let task = || catch_unwind(AssertUnwindSafe(task));
    let (ended, signal) = py.detach(|| match &pool {
        Some(pool) if is_main => wait(pool, task),
        Some(pool) => (pool.install(task), None),
        None => alone(is_main, task),
    });
    if is_main {
        STOP.store(false, Ordering::Relaxed);
    }
    let found = ended.map_err(|panic| defect(panic.as_ref()));
    (found, signal)
}

/// Lets the threads work and looks after signals.
fn wait<T: Send>(pool: &ThreadPool, task: impl FnOnce() -> T + Send) -> (T, Option<PyErr>) {
    let mut signal = None;
    let (tell, told) = channel();
    pool.in_place_scope(|scope| {
        scope.spawn(move |_| {
            // The other end waits.
            let _ = tell.send(task());
        });
        loop {
            match told.recv_timeout(LOOK) {
                Ok(found) => return (found, signal),
                Err(RecvTimeoutError::Timeout) if signal.is_none() => signal = raised(),
                Err(RecvTimeoutError::Timeout) => {}
                Err(RecvTimeoutError::Disconnected) => unreachable!("a task tells its end"),
            }
        }
    })
}

/// What the handler of a signal raises; then work is to stop.
fn raised() -> Option<PyErr> {
    let signal = Python::attach(|py| py.check_signals().err());
    if signal.is_some() {
        STOP.store(true, Ordering::Relaxed);
    }
    signal
}

thread_local! {
    /// What a handler has raised while this thread works by itself, and when it looks next.
    static RAISED: RefCell<Option<PyErr>> = const { RefCell::new(None) };
    static NEXT: Cell<Option<Instant>> = const { Cell::new(None) };
}

/// Works on the calling thread.
fn alone<T>(is_main: bool, task: impl FnOnce() -> T) -> (T, Option<PyErr>) {
    // A thread that belongs to a pool works in that one and starts no other. It is refused where it belongs to one
    // already, and stays in it for ever.
    std::mem::forget(ThreadPoolBuilder::new().num_threads(1).use_current_thread().build());
    NEXT.set(Some(Instant::now() + LOOK));
    interrupt::listen(is_main.then_some(look_now_and_then));
    let found = task();
    interrupt::listen(None);
    (found, RAISED.take())
}

fn look_now_and_then() -> bool {
    if NEXT.get().is_some_and(|next| Instant::now() >= next) && !STOP.load(Ordering::Relaxed) {
        NEXT.set(Some(Instant::now() + LOOK));
        RAISED.set(raised());
    }
    STOP.load(Ordering::Relaxed)
}

fn is_main_thread(py: Python<'_>) -> PyResult<bool> {
    let threading = py.import(intern!(py, "threading"))?;
    let main = threading.call_method0(intern!(py, "main_thread"))?.getattr(intern!(py, "ident"))?;
    main.eq(threading.call_method0(intern!(py, "get_ident"))?)
}

/// A defect of the core. Whoever was stopped says so by the signal.
fn defect(panic: &(dyn Any + Send)) -> PyErr {
    let said = panic.downcast_ref::<String>().map(String::as_str).or_else(|| panic.downcast_ref::<&str>().copied());
    let said = if panic.is::<Stopped>() { "stopped without a signal" } else { said.unwrap_or("no reason is known") };
    PyRuntimeError::new_err(format!("internal error of jointplay, please report it with the mechanism: {said}"))
}

#[cfg(test)]
mod tests {
    use rayon::prelude::*;

    use super::*;

    #[test]
    fn without_threads_the_caller_works_alone() {
        let here = thread::current().id();
        let ((threads, sum), signal) = alone(false, || {
            let threads: Vec<_> = (0..100).into_par_iter().map(|_| thread::current().id()).collect();
            (threads, (0..100).into_par_iter().sum::<usize>())
        });
        assert!(signal.is_none());
        assert!(threads.iter().all(|id| *id == here));
        assert_eq!(sum, 4950);
        // Twice on the same thread.
        assert_eq!(alone(false, || (0..10).into_par_iter().sum::<usize>()).0, 45);
    }

    #[test]
    fn panics_are_told_as_defects() {
        Python::initialize();
        let found = short(|| -> usize { panic!("a {}", "defect") });
        assert!(found.is_err_and(|e| e.to_string().contains("please report it with the mechanism: a defect")));
    }
}
