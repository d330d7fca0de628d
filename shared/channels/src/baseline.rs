//! What this machine's own means take, beside which the rack's figures are read: a timer's wake-up, and one way from
//! process to process through a pipe, a Unix socket, a futex on shared memory, and iceoryx2 polled and with the bell.
//!
//! Every message is sent at an absolute deadline and carries the time of its sending; the receiver compares. A timer's
//! wake-up counts from the deadline.

use crate::{Bell, Bells, ChannelError, Domain, Port, Sender, sleep_until, wall_ns};
use std::io::{BufRead, BufReader, Read, Write};
use std::os::fd::OwnedFd;
use std::os::unix::net::UnixStream;
use std::path::Path;
use std::process::{Command, Stdio};
use std::time::Duration;

/// Words of a message: 256 bytes.
const WORDS: usize = 32;
/// Time of sending of the last message.
const END: u64 = u64::MAX;
/// A receiver gives up when nothing comes for this long.
const PATIENCE: Duration = Duration::from_secs(10);
const CHANNEL: &str = "baseline";
const READY: &str = "ready";

type Message = [u64; WORDS];

/// How a message gets from one process to another.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Means {
    /// No message: a sleeper wakes up.
    Timer,
    /// A pipe.
    Pipe,
    /// A pair of Unix stream sockets.
    Socket,
    /// Words of shared memory, and a futex.
    Futex,
    /// iceoryx2, looked at without rest.
    Polled,
    /// iceoryx2, and this crate's bell.
    Blocking,
}

impl Means {
    /// All.
    pub const ALL: [Means; 6] =
        [Means::Timer, Means::Pipe, Means::Socket, Means::Futex, Means::Polled, Means::Blocking];

    /// Its name in tables.
    pub fn name(self) -> &'static str {
        match self {
            Means::Timer => "timer",
            Means::Pipe => "pipe",
            Means::Socket => "unix socket",
            Means::Futex => "futex on shared memory",
            Means::Polled => "iceoryx2 polled",
            Means::Blocking => "iceoryx2 blocking",
        }
    }

    /// The means of that name.
    pub fn from_name(name: &str) -> Option<Means> {
        Means::ALL.into_iter().find(|means| means.name() == name)
    }
}

enum Outgoing {
    Stream(std::fs::File),
    Shared(Bells),
    Channel(Sender<u64, u64>, Bells),
}

enum Incoming {
    Stream(std::io::StdinLock<'static>),
    Shared(Bells, Bell),
    Channel(Port<u64, u64>, Option<Bell>),
}

fn failed(means: Means, operation: &'static str) -> impl Fn(std::io::Error) -> ChannelError {
    move |error| ChannelError::Transport { channel: means.name().into(), operation, reason: error.to_string() }
}

fn bells(folder: &Path) -> Result<Bells, ChannelError> {
    // a message lies in the words of two bells that nobody rings
    Bells::open(&folder.join("baseline"), 3)
}

/// Sends `count` messages, one every `period_ns`, to a process that `receiver` starts and that calls [`receive`]; returns
/// how long each took, ns.
pub fn measure(
    means: Means,
    count: u32,
    period_ns: u64,
    mut receiver: Command,
    folder: &Path,
    prefix: &str,
) -> Result<Vec<u64>, ChannelError> {
    let start = wall_ns() + period_ns;
    let deadlines = (0..u64::from(count)).map(|i| i * period_ns);
    if means == Means::Timer {
        let wake_up = |due| {
            sleep_until(start + due, Duration::MAX);
            wall_ns().saturating_sub(start + due)
        };
        return Ok(deadlines.map(wake_up).collect());
    }
    let failed = |operation| failed(means, operation);
    let domain = Domain::join(folder, prefix, "sender")?;
    let mut input = Stdio::null();
    let mut stream = |near: OwnedFd, far: OwnedFd| {
        input = far.into();
        Outgoing::Stream(near.into())
    };
    let mut outgoing = match means {
        Means::Timer | Means::Pipe => {
            let (far, near) = std::io::pipe().map_err(failed("opening"))?;
            stream(near.into(), far.into())
        }
        Means::Socket => {
            let (far, near) = UnixStream::pair().map_err(failed("opening"))?;
            stream(near.into(), far.into())
        }
        Means::Futex => Outgoing::Shared(bells(folder)?),
        Means::Polled | Means::Blocking => {
            Outgoing::Channel(Sender::open(&domain, CHANNEL, 1, 64, WORDS)?, bells(folder)?)
        }
    };
    let mut child = receiver.stdin(input).stdout(Stdio::piped()).spawn().map_err(failed("starting the receiver"))?;
    let mut answers = child.stdout.take().into_iter().flat_map(|output| BufReader::new(output).lines());
    let mut answer = || answers.next().transpose().map_err(failed("hearing the receiver"));
    if answer()?.as_deref() != Some(READY) {
        return Err(failed("hearing the receiver")(std::io::ErrorKind::UnexpectedEof.into()));
    }
    let start = wall_ns() + period_ns;
    for due in deadlines {
        sleep_until(start + due, Duration::MAX);
        outgoing.send(wall_ns()).map_err(|reason| failed("sending")(std::io::Error::other(reason)))?;
    }
    sleep_until(start + u64::from(count) * period_ns, Duration::MAX);
    outgoing.send(END).map_err(|reason| failed("sending")(std::io::Error::other(reason)))?;
    let mut times = Vec::with_capacity(count as usize);
    while let Some(line) = answer()? {
        times.push(line.parse().map_err(|_| failed("hearing the receiver")(std::io::ErrorKind::InvalidData.into()))?);
    }
    child.wait().map_err(failed("ending the receiver"))?;
    Ok(times)
}

impl Outgoing {
    fn send(&mut self, stamp: u64) -> Result<(), String> {
        let message: Message = [stamp; WORDS];
        match self {
            Outgoing::Stream(stream) => {
                stream.write_all(bytemuck::cast_slice(&message)).map_err(|error| error.to_string())
            }
            Outgoing::Shared(bells) => {
                bells.put(1, bytemuck::cast_slice(&message));
                bells.ring(0);
                Ok(())
            }
            Outgoing::Channel(sender, bells) => {
                sender.send(&stamp, &message).map_err(|error| error.to_string())?;
                bells.ring(0);
                Ok(())
            }
        }
    }
}

/// Receives what [`measure`] sends to this process; writes "ready", and at the end how long each message took, ns, a line
/// each, to `output`.
pub fn receive(means: Means, folder: &Path, prefix: &str, output: &mut dyn Write) -> Result<(), ChannelError> {
    let failed = |operation| failed(means, operation);
    let domain = Domain::join(folder, prefix, "receiver")?;
    let mut incoming = match means {
        Means::Timer | Means::Pipe | Means::Socket => Incoming::Stream(std::io::stdin().lock()),
        Means::Futex => {
            let bells = bells(folder)?;
            Incoming::Shared(bells.clone(), bells.bell(0))
        }
        Means::Polled => Incoming::Channel(Port::open(&domain, CHANNEL, 1, 64)?, None),
        Means::Blocking => Incoming::Channel(Port::open(&domain, CHANNEL, 1, 64)?, Some(bells(folder)?.bell(0))),
    };
    writeln!(output, "{READY}").and_then(|()| output.flush()).map_err(failed("answering"))?;
    let mut times = Vec::with_capacity(100_000);
    while let Some(sent) = incoming.next()?.filter(|sent| *sent != END) {
        times.push(wall_ns().saturating_sub(sent));
    }
    times.iter().try_for_each(|time| writeln!(output, "{time}")).map_err(failed("answering"))
}

impl Incoming {
    /// When the next message was sent; `None` where none comes.
    fn next(&mut self) -> Result<Option<u64>, ChannelError> {
        let mut message: Message = [0; WORDS];
        match self {
            Incoming::Stream(stream) => {
                let read = stream.read_exact(bytemuck::cast_slice_mut(&mut message));
                Ok(read.is_ok().then_some(message[0]))
            }
            Incoming::Shared(bells, bell) => {
                if bell.block(PATIENCE) == 0 {
                    return Ok(None);
                }
                bells.get(1, bytemuck::cast_slice_mut(&mut message));
                Ok(Some(message[0]))
            }
            Incoming::Channel(port, bell) => {
                let since = wall_ns();
                loop {
                    let mut sent = None;
                    port.receive(|stamp, words| {
                        sent = Some(*stamp);
                        words.zip(&mut message).for_each(|(word, place)| *place = *word);
                    })?;
                    if sent.is_some() || wall_ns() - since > PATIENCE.as_nanos() as u64 {
                        return Ok(sent);
                    }
                    match bell {
                        Some(bell) => drop(bell.wait(PATIENCE)),
                        // a single processor must be left to the sender
                        None => std::thread::yield_now(),
                    }
                }
            }
        }
    }
}
