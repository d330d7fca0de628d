//! Powers the processes of a run up, watches them, and ends them.
//!
//! The lifeline of a process is its standard input: a pipe whose other end the chassis holds and never writes to. When it
//! closes, the process flushes and leaves. Ctrl-C reaches the chassis only: the processes have a group of their own.

use crate::RunError;
use rustix::process::{Pid, Signal, kill_process};
use std::os::fd::AsFd;
use std::os::unix::process::{CommandExt, ExitStatusExt};
use std::path::Path;
use std::process::{Child, Command, ExitStatus, Stdio};
use std::time::{Duration, Instant};

/// Time that processes get to flush and leave before they are killed.
const LEAVE: Duration = Duration::from_secs(2);

/// The processes of a run.
#[derive(Default)]
pub struct Power {
    children: Vec<(String, Child)>,
    /// Processes that hang as planned.
    hanging: Vec<String>,
}

impl Power {
    /// Starts one process: `command` with the run folder and its own name appended. Returns its number.
    pub fn spawn(&mut self, name: &str, command: &[String], folder: &Path) -> Result<u32, RunError> {
        let program = command.first().cloned().unwrap_or_default();
        let failed = |error: std::io::Error| RunError::Spawn {
            process: name.to_owned(),
            program: program.clone(),
            reason: error.to_string(),
        };
        // results go to standard output, and only the chassis has any
        let stderr = std::io::stderr().as_fd().try_clone_to_owned().map_err(failed)?;
        let child = Command::new(&program)
            .args(command.iter().skip(1))
            .arg("--run")
            .arg(folder)
            .arg("--process")
            .arg(name)
            .stdin(Stdio::piped())
            .stdout(Stdio::from(stderr))
            .process_group(0)
            .spawn()
            .map_err(failed)?;
        let pid = child.id();
        self.children.push((name.to_owned(), child));
        Ok(pid)
    }

    /// Process numbers, in the order of starting.
    pub fn pids(&self) -> impl Iterator<Item = (&str, u32)> {
        self.children.iter().map(|(name, child)| (name.as_str(), child.id()))
    }

    /// Kills (or, to make it hang, stops) a process, and confirms that it has ended (or is in state T). The message says
    /// what the operating system refused or showed.
    pub fn take_down(&mut self, name: &str, hang: bool) -> Result<(), String> {
        if !hang {
            return if self.remove(name) { Ok(()) } else { Err("it had ended before".into()) };
        }
        let pid = self.pid(name).ok_or("it had ended before")?;
        kill_process(pid, Signal::STOP).map_err(|error| error.to_string())?;
        let deadline = Instant::now() + LEAVE;
        while !self.is_stopped(name) {
            if Instant::now() > deadline {
                return Err("it goes on".into());
            }
            std::thread::sleep(Duration::from_micros(200));
        }
        self.hanging.push(name.to_owned());
        Ok(())
    }

    /// Ends a process with SIGKILL, if it has not ended, and forgets it. False where there was none that lived.
    pub fn remove(&mut self, name: &str) -> bool {
        let Some(i) = self.children.iter().position(|(known, _)| known == name) else { return false };
        let (_, mut child) = self.children.remove(i);
        self.hanging.retain(|known| known != name);
        let lived = matches!(child.try_wait(), Ok(None));
        kill(&mut child);
        lived
    }

    fn pid(&self, name: &str) -> Option<Pid> {
        let (_, child) = self.children.iter().find(|(known, _)| known == name)?;
        Pid::from_raw(child.id() as i32)
    }

    /// A process that has ended, killed ones first, since others may have followed them.
    pub fn ended(&mut self) -> Option<(String, String)> {
        let mut ended: Vec<(String, ExitStatus)> = Vec::new();
        for (name, child) in &mut self.children {
            if let Ok(Some(status)) = child.try_wait() {
                ended.push((name.clone(), status));
            }
        }
        ended.sort_by_key(|(_, status)| status.signal().is_none());
        ended.into_iter().next().map(|(name, status)| (name, describe(status)))
    }

    /// Whether the process is stopped or has used no processor time since `before`; its words for it.
    pub fn idle(&self, name: &str, before: u64) -> Option<&'static str> {
        let (state, used) = self.activity(name)?;
        match state {
            'T' | 't' => Some("stopped by a signal"),
            _ if used == before => Some("alive, but it uses no processor time"),
            _ => None,
        }
    }

    /// A process in state T that is not to hang.
    pub fn stopped(&self) -> Option<&str> {
        let names = self.children.iter().map(|(name, _)| name.as_str());
        names.filter(|name| !self.hanging.iter().any(|hanging| hanging == name)).find(|name| self.is_stopped(name))
    }

    /// Whether the process is in state T.
    pub fn is_stopped(&self, name: &str) -> bool {
        matches!(self.activity(name), Some(('T' | 't', _)))
    }

    /// Processor time used by the process so far, clock ticks.
    pub fn used(&self, name: &str) -> u64 {
        self.activity(name).map_or(0, |(_, used)| used)
    }

    fn activity(&self, name: &str) -> Option<(char, u64)> {
        let (_, child) = self.children.iter().find(|(known, _)| known == name)?;
        let stat = std::fs::read_to_string(format!("/proc/{}/stat", child.id())).ok()?;
        // the name in parentheses may hold anything
        let fields: Vec<&str> = stat.rsplit_once(')')?.1.split_whitespace().collect();
        let state = fields.first()?.chars().next()?;
        let used = fields.get(11)?.parse::<u64>().ok()? + fields.get(12)?.parse::<u64>().ok()?;
        Some((state, used))
    }

    /// Ends all processes: lifelines first, SIGKILL for those that do not leave. Returns the names of the killed.
    pub fn shut_down(&mut self) -> Vec<String> {
        for (name, child) in &mut self.children {
            drop(child.stdin.take());
            if self.hanging.contains(name) {
                kill(child);
            }
        }
        let deadline = Instant::now() + LEAVE;
        let mut killed = Vec::new();
        for (name, child) in &mut self.children {
            loop {
                match child.try_wait() {
                    Ok(Some(_)) | Err(_) => break,
                    Ok(None) if Instant::now() < deadline => std::thread::sleep(Duration::from_millis(2)),
                    Ok(None) => {
                        kill(child);
                        killed.push(name.clone());
                        break;
                    }
                }
            }
        }
        self.children.clear();
        killed
    }
}

impl Drop for Power {
    fn drop(&mut self) {
        self.shut_down();
    }
}

/// Kills and reaps it; it may have ended in this very moment.
fn kill(child: &mut Child) {
    let _ = child.kill();
    let _ = child.wait();
}

fn describe(status: ExitStatus) -> String {
    match (status.code(), status.signal()) {
        (Some(code), _) => format!("ended with exit code {code}"),
        (None, Some(9)) => "was killed (SIGKILL)".into(),
        (None, Some(signal)) => format!("was killed by signal {signal}"),
        (None, None) => "ended".into(),
    }
}
