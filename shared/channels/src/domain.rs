//! One iceoryx2 domain per run.

use crate::ChannelError;
use crate::page::Page;
use board::routes::ROUTES;
use iceoryx2::prelude::*;
use std::path::{Path as StdPath, PathBuf};
use std::sync::atomic::Ordering;
use std::time::Duration;

/// How long a process waits for another that is opening the same channel.
const PATIENCE: Duration = Duration::from_secs(20);
/// Folder of the shared-memory files.
const SHARED_MEMORY: &str = "/dev/shm";

/// The iceoryx2 node of one process in the domain of its run.
#[derive(Debug)]
pub struct Domain {
    pub(crate) node: Node<ipc::Service>,
    pub(crate) protocol: u32,
    /// How many messages each route has carried; behind that, [`DOWN_WORD`] and [`REBORN_WORD`].
    pub(crate) tally: Page,
}

/// Bits of the boards that are down now: messages need not reach them.
pub(crate) const DOWN_WORD: usize = ROUTES.len();
/// Bits of the boards that were started again: their messages may have a gap or a repetition where they died.
pub(crate) const REBORN_WORD: usize = ROUTES.len() + 1;

impl Domain {
    /// Joins the domain that belongs to a run folder. `prefix` is unique to the run; the folder's path must be short
    /// (sockets fail near 73 characters).
    pub fn join(folder: &StdPath, prefix: &str, process: &str) -> Result<Domain, ChannelError> {
        let setup = |operation, reason: String| ChannelError::Setup { channel: process.to_owned(), operation, reason };
        // never the global configuration: it reads files in the working directory
        let mut config = Config::default();
        let root = folder.join("iox2");
        config.global.prefix =
            FileName::new(prefix.as_bytes()).map_err(|error| setup("naming the domain", format!("{error:?}")))?;
        let root = Path::new(root.as_os_str().as_encoded_bytes())
            .map_err(|error| setup("placing the domain", format!("{}: {error:?}", root.display())))?;
        config.global.set_root_path(&root);
        // a process of a loaded machine may be kept waiting in the middle of opening a channel
        config.global.creation_timeout = PATIENCE;
        // while a run lives only the chassis cleans, and it removes the whole domain
        config.global.node.cleanup_dead_nodes_on_creation = false;
        config.global.node.cleanup_dead_nodes_on_destruction = false;
        config.global.service.cleanup_dead_nodes_on_open = false;
        let name = NodeName::new(process).map_err(|error| setup("naming the node", format!("{error:?}")))?;
        let node = NodeBuilder::new()
            .name(&name)
            .config(&config)
            .signal_handling_mode(SignalHandlingMode::Disabled)
            .create::<ipc::Service>()
            .map_err(|error| setup("creating the node", format!("{error:?}")))?;
        let tally = Page::open(&folder.join("tally"), ROUTES.len() + 2)?;
        Ok(Domain { node, protocol: messages::PROTOCOL, tally })
    }

    /// From now on messages need not reach these boards (a bit each, by number), and only these.
    pub fn set_down(&self, boards: u32) {
        self.tally.word(DOWN_WORD).store(boards, Ordering::SeqCst);
    }

    /// Removes what dead processes have left in the domain, so that others may take their places, which are those of
    /// `boards`. For the chassis alone.
    pub fn clean_dead(&self, boards: u32) {
        self.tally.word(REBORN_WORD).fetch_or(boards, Ordering::SeqCst);
        // what cannot be removed shows when the place is taken
        let _ = Node::<ipc::Service>::list(self.node.config(), |state| {
            if let NodeState::Dead(view) = state {
                let _ = view.try_remove_stale_resources();
            }
            CallbackProgression::Continue
        });
    }
}

/// Removes what is left in shared memory of the run with this prefix; names what could not be removed.
pub fn remove_leftovers(prefix: &str) -> Vec<PathBuf> {
    let Ok(entries) = std::fs::read_dir(SHARED_MEMORY) else { return Vec::new() };
    entries
        .flatten()
        .filter(|entry| entry.file_name().to_string_lossy().starts_with(prefix))
        .map(|entry| entry.path())
        .filter(|path| std::fs::remove_file(path).is_err() && path.exists())
        .collect()
}
