//! Round trips between two processes: iceoryx2 polled, iceoryx2 with the bell, and a pipe, same size, same run. Prints
//! nanoseconds of one way: `cargo run --release -p channels --example hop`.

use channels::{Bells, Domain, Port, Sender};
use std::error::Error;
use std::io::{Read, Write};
use std::path::Path;
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

/// Payload, bytes.
const SIZE: usize = 256;
const ROUNDS: usize = 20_000;
/// The echo gives up when nothing comes for this long.
const PATIENCE: Duration = Duration::from_secs(10);

type Result<T> = std::result::Result<T, Box<dyn Error>>;

fn main() -> Result<()> {
    let arguments: Vec<String> = std::env::args().collect();
    if let [_, mode, folder, prefix] = arguments.as_slice() {
        return if mode == "pipe" { echo_pipe() } else { echo_channel(Path::new(folder), prefix, mode == "bell") };
    }
    let folder = tempfile::tempdir()?;
    let prefix = format!("hop{}_", std::process::id());
    println!("{:10} {:>10} {:>10} {:>10}", "one way", "p50 ns", "p99 ns", "min ns");
    for mode in ["pipe", "polled", "bell"] {
        let mut times =
            if mode == "pipe" { ask_pipe(folder.path(), &prefix)? } else { ask_channel(folder.path(), &prefix, mode)? };
        times.sort_unstable();
        println!(
            "{mode:10} {:>10} {:>10} {:>10}",
            times[times.len() / 2] / 2,
            times[times.len() * 99 / 100] / 2,
            times[0] / 2
        );
    }
    channels::remove_leftovers(&prefix);
    Ok(())
}

fn echo(mode: &str, folder: &Path, prefix: &str) -> Result<std::process::Child> {
    let this = std::env::current_exe()?;
    Ok(Command::new(this).arg(mode).arg(folder).arg(prefix).stdin(Stdio::piped()).stdout(Stdio::piped()).spawn()?)
}

fn ask_pipe(folder: &Path, prefix: &str) -> Result<Vec<u64>> {
    let mut child = echo("pipe", folder, prefix)?;
    let (Some(mut to), Some(mut from)) = (child.stdin.take(), child.stdout.take()) else {
        return Err("no pipes".into());
    };
    let mut bytes = [7; SIZE];
    let mut times = Vec::with_capacity(ROUNDS);
    for _ in 0..ROUNDS {
        let start = Instant::now();
        to.write_all(&bytes)?;
        from.read_exact(&mut bytes)?;
        times.push(start.elapsed().as_nanos() as u64);
    }
    drop(to);
    child.wait()?;
    Ok(times)
}

fn echo_pipe() -> Result<()> {
    let mut bytes = [0; SIZE];
    while std::io::stdin().read_exact(&mut bytes).is_ok() {
        std::io::stdout().write_all(&bytes)?;
        std::io::stdout().flush()?;
    }
    Ok(())
}

fn ask_channel(folder: &Path, prefix: &str, mode: &str) -> Result<Vec<u64>> {
    let folder = folder.join(mode);
    std::fs::create_dir_all(&folder)?;
    let domain = Domain::join(&folder, prefix, "ask")?;
    let to = Sender::<u64, u64>::open(&domain, "there", 1, 4, SIZE / 8)?;
    let from = Port::<u64, u64>::open(&domain, "back", 1, 4)?;
    let bells = Bells::open(&folder.join("bells"), 2)?;
    let mut bell = bells.bell(0);
    let mut child = echo(mode, &folder, prefix)?;
    // the echo says that it is there
    while !from.receive(|_, _| {})? {
        bell.wait(Duration::from_millis(1));
    }
    let mut times = Vec::with_capacity(ROUNDS);
    for round in 0..ROUNDS as u64 {
        let start = Instant::now();
        to.send(&round, &[7; SIZE / 8])?;
        bells.ring(1);
        while !from.receive(|_, _| {})? {
            if mode == "bell" {
                bell.wait(PATIENCE);
            }
            if start.elapsed() > PATIENCE {
                return Err("the echo is silent".into());
            }
        }
        times.push(start.elapsed().as_nanos() as u64);
    }
    to.send(&u64::MAX, &[])?;
    bells.ring(1);
    child.wait()?;
    Ok(times)
}

fn echo_channel(folder: &Path, prefix: &str, with_bell: bool) -> Result<()> {
    let domain = Domain::join(folder, prefix, "echo")?;
    let from = Port::<u64, u64>::open(&domain, "there", 1, 4)?;
    let to = Sender::<u64, u64>::open(&domain, "back", 1, 4, SIZE / 8)?;
    let bells = Bells::open(&folder.join("bells"), 2)?;
    let mut bell = bells.bell(1);
    to.send(&0, &[0; SIZE / 8])?;
    bells.ring(0);
    let mut heard = Instant::now();
    let mut end = false;
    while !end && heard.elapsed() < PATIENCE {
        let mut payload = [0; SIZE / 8];
        let came = from.receive(|round, words| {
            end = *round == u64::MAX;
            words.zip(&mut payload).for_each(|(word, place)| *place = *word);
        })?;
        if came && !end {
            heard = Instant::now();
            to.send(&0, &payload)?;
            bells.ring(0);
        } else if !came && with_bell {
            bell.wait(PATIENCE);
        }
    }
    Ok(())
}
