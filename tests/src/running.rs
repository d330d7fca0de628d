//! A command that runs, under a watchdog, and what it came to.

use crate::machine::{self, Process, Signal, signal};
use std::collections::BTreeSet;
use std::io::Read;
use std::os::unix::process::ExitStatusExt;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, ExitStatus, Stdio};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

/// No run takes longer.
const WATCHDOG: Duration = Duration::from_secs(60);
/// Folder of the shared-memory files.
const SHARED_MEMORY: &str = "/dev/shm";
const POLL: Duration = Duration::from_millis(5);
/// Processes that outlive the command get this long to follow it, as they look at their lifeline now and then.
const FOLLOW: Duration = Duration::from_secs(5);

/// A command under way. Dropped, it is killed with all its processes.
pub struct Running {
    child: Child,
    temporary: PathBuf,
    started: Instant,
    output: Option<[JoinHandle<String>; 2]>,
    /// Folders of runs seen so far: their names are part of the names in shared memory.
    folders: BTreeSet<String>,
}

/// What a command came to.
#[derive(Debug)]
pub struct Outcome {
    /// How it ended.
    pub status: ExitStatus,
    /// Its standard output.
    pub stdout: String,
    /// Its standard error, that of its processes included.
    pub stderr: String,
    /// Wall time from the start to the end, or from the last [`Running::mark`].
    pub took: Duration,
    /// Processes, folders and shared memory that are still there.
    pub left: Vec<String>,
}

fn read(source: Option<impl Read + Send + 'static>) -> JoinHandle<String> {
    std::thread::spawn(move || {
        let mut bytes = Vec::new();
        if let Some(mut source) = source {
            // what was read up to an error still helps
            let _ = source.read_to_end(&mut bytes);
        }
        String::from_utf8_lossy(&bytes).into_owned()
    })
}

impl Running {
    pub(crate) fn start(mut command: Command, temporary: &Path) -> Running {
        command.stdin(Stdio::null()).stdout(Stdio::piped()).stderr(Stdio::piped());
        let mut child = command.spawn().unwrap_or_else(|error| panic!("{command:?}: {error}"));
        let output = Some([read(child.stdout.take()), read(child.stderr.take())]);
        let temporary = temporary.to_path_buf();
        Running { child, temporary, started: Instant::now(), output, folders: BTreeSet::new() }
    }

    /// Process number of the command itself.
    pub fn pid(&self) -> u32 {
        self.child.id()
    }

    /// The processes of the run that live now, the command included.
    pub fn processes(&self) -> Vec<Process> {
        machine::processes_with(&self.temporary)
    }

    /// Waits until `count` boards' processes live; returns them.
    pub fn wait_for_processes(&mut self, count: usize) -> Vec<Process> {
        loop {
            let mut processes = self.processes();
            processes.retain(|process| process.name != "vmerack");
            if processes.len() >= count {
                self.look();
                return processes;
            }
            assert!(self.started.elapsed() < WATCHDOG, "{} of {count} processes after 60 s", processes.len());
            self.pause(POLL);
        }
    }

    /// Waits until windows have passed, as whoever watches a run does: it is asked to show itself.
    pub fn wait_until_it_runs(&mut self) {
        loop {
            self.pause(POLL);
            for base in machine::entries(&self.temporary).iter().filter(|name| name.starts_with("vmerack-")) {
                for run in machine::entries(&self.temporary.join(base)) {
                    let folder = self.temporary.join(base).join(run);
                    // it may end at any moment
                    let _ = std::fs::write(folder.join("watched"), "");
                    if folder.join("status.json").exists() {
                        return;
                    }
                }
            }
            assert!(self.started.elapsed() < WATCHDOG, "no window after 60 s");
        }
    }

    /// Lets the run go on for so long; fails where it ends by itself.
    pub fn pause(&mut self, time: Duration) {
        let until = Instant::now() + time;
        loop {
            self.look();
            if let Ok(Some(status)) = self.child.try_wait() {
                let [_, stderr] = self.join();
                panic!("the run ended too early ({status}):\n{stderr}");
            }
            let left = until.saturating_duration_since(Instant::now());
            if left.is_zero() {
                return;
            }
            std::thread::sleep(left.min(POLL));
        }
    }

    /// [`Outcome::took`] counts from now.
    pub fn mark(&mut self) {
        self.started = Instant::now();
    }

    fn look(&mut self) {
        for base in machine::entries(&self.temporary).iter().filter(|name| name.starts_with("vmerack-")) {
            self.folders.extend(machine::entries(&self.temporary.join(base)));
        }
    }

    /// Waits for the end. One that does not come within 60 s fails the test.
    pub fn wait(mut self) -> Outcome {
        let status = loop {
            self.look();
            if let Ok(Some(status)) = self.child.try_wait() {
                break status;
            }
            if self.started.elapsed() > WATCHDOG {
                let processes = self.processes();
                self.kill_all();
                let [stdout, stderr] = self.join();
                panic!("no end after {WATCHDOG:?}; processes: {processes:?}\nstdout: {stdout}\nstderr: {stderr}");
            }
            std::thread::sleep(POLL);
        };
        let ended = Instant::now();
        while !self.left().is_empty() && ended.elapsed() < FOLLOW {
            std::thread::sleep(POLL);
        }
        let took = self.started.elapsed();
        let left = self.left();
        // a process that is left would keep the pipes open
        self.kill_all();
        let [stdout, stderr] = self.join();
        Outcome { status, stdout, stderr, took, left }
    }

    fn left(&self) -> Vec<String> {
        let processes =
            self.processes().into_iter().map(|process| format!("process {} ({})", process.name, process.pid));
        let files =
            machine::entries(&self.temporary).into_iter().map(|name| self.temporary.join(name).display().to_string());
        let shared = self.shared_memory().map(|file| file.display().to_string());
        processes.chain(files).chain(shared).collect()
    }

    fn kill_all(&mut self) {
        loop {
            let processes = self.processes();
            processes.iter().for_each(|process| signal(process.pid, Signal::KILL));
            if processes.iter().all(|process| process.pid == self.pid()) {
                break;
            }
            std::thread::sleep(POLL);
        }
        // it may have ended already
        let _ = self.child.kill();
        let _ = self.child.wait();
        // their folders go with the test: nobody could tell later whose this was
        for file in self.shared_memory() {
            let _ = std::fs::remove_file(file);
        }
    }

    fn shared_memory(&self) -> impl Iterator<Item = PathBuf> {
        machine::entries(Path::new(SHARED_MEMORY))
            .into_iter()
            .filter(|name| self.folders.iter().any(|folder| name.contains(folder.as_str())))
            .map(|name| Path::new(SHARED_MEMORY).join(name))
    }

    fn join(&mut self) -> [String; 2] {
        self.output
            .take()
            .map_or_else(Default::default, |readers| readers.map(|reader| reader.join().unwrap_or_default()))
    }
}

impl Drop for Running {
    fn drop(&mut self) {
        self.kill_all();
    }
}

impl Outcome {
    /// Fails where the exit code is another.
    pub fn expect_code(self, code: i32) -> Outcome {
        assert_eq!(
            self.status.code(),
            Some(code),
            "signal {:?}\nstdout: {}\nstderr: {}",
            self.status.signal(),
            self.stdout,
            self.stderr
        );
        self
    }

    /// Fails where processes, folders or shared memory are left.
    pub fn expect_nothing_left(self) -> Outcome {
        assert!(self.left.is_empty(), "left behind: {:#?}\nstderr: {}", self.left, self.stderr);
        self
    }

    /// Fails where the error output does not say this.
    pub fn expect_message(self, part: &str) -> Outcome {
        // messages may be wrapped
        let flat = |text: &str| text.split_whitespace().filter(|word| *word != "│").collect::<Vec<_>>().join(" ");
        assert!(flat(&self.stderr).contains(&flat(part)), "no {part:?} in:\n{}", self.stderr);
        self
    }
}
