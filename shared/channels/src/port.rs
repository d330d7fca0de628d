//! One typed channel: a slice of plain old data under a header.

use crate::pod::Plain;
use crate::{ChannelError, Domain};
use bytemuck::Pod;
use iceoryx2::port::publisher::Publisher;
use iceoryx2::port::subscriber::Subscriber;
use iceoryx2::prelude::*;
use std::fmt::Debug;

type Service<T, H> =
    iceoryx2::service::port_factory::publish_subscribe::PortFactory<ipc::Service, [Plain<T>], Plain<H>>;

/// The sending end.
pub struct Sender<T: Pod + Debug, H: Pod + Debug> {
    name: String,
    readers: usize,
    publisher: Publisher<ipc::Service, [Plain<T>], Plain<H>>,
}

/// A receiving end.
pub struct Port<T: Pod + Debug, H: Pod + Debug> {
    name: String,
    subscriber: Subscriber<ipc::Service, [Plain<T>], Plain<H>>,
}

fn service<T: Pod + Debug, H: Pod + Debug>(
    domain: &Domain,
    name: &str,
    buffer: usize,
    readers: usize,
) -> Result<Service<T, H>, ChannelError> {
    let setup = |operation, reason: String| ChannelError::Setup { channel: name.to_owned(), operation, reason };
    let service_name = ServiceName::new(&format!("{}/{name}", domain.protocol))
        .map_err(|error| setup("naming the channel", format!("{error:?}")))?;
    domain
        .node
        .service_builder(&service_name)
        .publish_subscribe::<[Plain<T>]>()
        .user_header::<Plain<H>>()
        .history_size(0)
        .subscriber_max_buffer_size(buffer)
        .max_publishers(1)
        .max_subscribers(readers.max(1))
        // nothing is ever dropped silently
        .enable_safe_overflow(false)
        .open_or_create()
        .map_err(|error| setup("opening the channel", format!("{error:?}")))
}

impl<T: Pod + Debug, H: Pod + Debug> Sender<T, H> {
    /// Opens the sending end towards `readers` other processes, each with room for `buffer` messages. Up to `length`
    /// elements a message needs no new memory; a longer one allocates once.
    pub fn open(
        domain: &Domain,
        name: &str,
        readers: usize,
        buffer: usize,
        length: usize,
    ) -> Result<Self, ChannelError> {
        let publisher = service::<T, H>(domain, name, buffer, readers)?
            .publisher_builder()
            .initial_max_slice_len(length)
            .allocation_strategy(AllocationStrategy::PowerOfTwo)
            .backpressure_strategy(BackpressureStrategy::DiscardData)
            .create()
            .map_err(|error| ChannelError::Setup {
                channel: name.to_owned(),
                operation: "creating the sending end",
                reason: format!("{error:?}"),
            })?;
        Ok(Sender { name: name.to_owned(), readers, publisher })
    }

    /// Sends one message; an error where it does not reach every reader.
    pub fn send(&self, header: &H, payload: &[T]) -> Result<(), ChannelError> {
        let failed =
            |operation, reason: String| ChannelError::Transport { channel: self.name.clone(), operation, reason };
        let mut sample =
            self.publisher.loan_slice_uninit(payload.len()).map_err(|error| failed("loaning", format!("{error:?}")))?;
        sample.user_header_mut().0 = *header;
        let reached = sample
            .write_from_fn(|i| Plain(payload[i]))
            .send()
            .map_err(|error| failed("sending", format!("{error:?}")))?;
        if reached < self.readers {
            return Err(ChannelError::Undelivered { channel: self.name.clone(), reached, readers: self.readers });
        }
        Ok(())
    }

    /// Readers may leave for good: from now on this many are expected.
    pub fn expect_readers(&mut self, readers: usize) {
        self.readers = readers;
    }
}

impl<T: Pod + Debug, H: Pod + Debug> Port<T, H> {
    /// Opens a receiving end; `readers` and `buffer` as for [`Sender::open`].
    pub fn open(domain: &Domain, name: &str, readers: usize, buffer: usize) -> Result<Self, ChannelError> {
        let subscriber =
            service::<T, H>(domain, name, buffer, readers)?.subscriber_builder().buffer_size(buffer).create().map_err(
                |error| ChannelError::Setup {
                    channel: name.to_owned(),
                    operation: "creating a receiving end",
                    reason: format!("{error:?}"),
                },
            )?;
        Ok(Port { name: name.to_owned(), subscriber })
    }

    /// Takes the next message, if there is one.
    pub fn receive(&self, mut take: impl FnMut(&H, &mut dyn Iterator<Item = &T>)) -> Result<bool, ChannelError> {
        let sample = self.subscriber.receive().map_err(|error| ChannelError::Transport {
            channel: self.name.clone(),
            operation: "receiving",
            reason: format!("{error:?}"),
        })?;
        match sample {
            Some(sample) => {
                take(&sample.user_header().0, &mut sample.payload().iter().map(|element| &element.0));
                Ok(true)
            }
            None => Ok(false),
        }
    }

    /// Takes up to so many messages; fewer where there are no more.
    pub fn receive_up_to(
        &self,
        messages: u32,
        mut take: impl FnMut(&H, &mut dyn Iterator<Item = &T>),
    ) -> Result<(), ChannelError> {
        for _ in 0..messages {
            if !self.receive(&mut take)? {
                break;
            }
        }
        Ok(())
    }

    /// Name of the channel.
    pub fn name(&self) -> &str {
        &self.name
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_message_longer_than_the_memory_made_for_it_arrives() {
        let folder = tempfile::tempdir().expect("folder");
        let prefix = format!("p{}x_", std::process::id());
        {
            let domain = Domain::join(folder.path(), &prefix, "a").expect("domain");
            let sender = Sender::<u64, u64>::open(&domain, "long", 1, 4, 2).expect("sender");
            let port = Port::<u64, u64>::open(&domain, "long", 1, 4).expect("port");
            let payload: Vec<u64> = (0..500).collect();
            for length in [1, 500, 3] {
                sender.send(&7, &payload[..length]).expect("send");
                let mut got: Vec<u64> = Vec::new();
                port.receive(|_, elements| got.extend(elements)).expect("receive");
                assert_eq!(got, payload[..length]);
            }
        }
        assert!(crate::remove_leftovers(&prefix).is_empty());
    }
}
