//! A place for the runs of one test: folder, scenario files, `TMPDIR`.

use crate::programs::program;
use crate::running::{Outcome, Running};
use std::path::PathBuf;
use std::process::Command;
use tempfile::TempDir;
use toml::{Table, Value};

/// A place for the runs of one test, removed at its end.
pub struct Bench {
    folder: TempDir,
}

/// A change of a scenario: key path and value.
pub type Edit<'a> = (&'a str, Value);

impl Bench {
    /// An empty one.
    pub fn new() -> Bench {
        // short, because sockets lie in it
        let folder = tempfile::Builder::new().prefix("vt").tempdir_in("/tmp").expect("folder in /tmp");
        std::fs::create_dir(folder.path().join("t")).expect("folder for temporary files");
        Bench { folder }
    }

    /// Path of a file of this bench.
    pub fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    /// `TMPDIR` of the runs.
    pub(crate) fn temporary(&self) -> PathBuf {
        self.path("t")
    }

    /// Writes a file.
    pub fn write(&self, name: &str, content: impl AsRef<[u8]>) {
        std::fs::write(self.path(name), content).expect("write into the bench's folder");
    }

    /// A scenario file made of the built-in `table-5-3`: every key stated, one variant `nominal`, no limits, no sweeps, and
    /// these changes; returns `name`. A key path counts array elements from 0 or calls them by name.
    pub fn scenario<'n>(&self, name: &'n str, edits: &[Edit<'_>]) -> &'n str {
        let document = scenario::load("table-5-3", &[]).expect("built-in scenario");
        let text = toml::to_string(&document.scenario().expect("built-in scenario")).expect("scenario as text");
        let mut tree: Table = text.parse().expect("scenario as a tree");
        for key in ["variant", "limit", "report"] {
            tree.remove(key);
        }
        let mut root = Value::Table(tree);
        for (key, value) in edits {
            set(&mut root, key, value.clone());
        }
        self.write(name, toml::to_string(&root).expect("scenario as text"));
        name
    }

    /// Starts `vmerack` with these arguments; its working folder is the bench's.
    pub fn start(&self, arguments: &[&str]) -> Running {
        let mut command = Command::new(program("vmerack"));
        command.args(arguments);
        self.start_command(command)
    }

    /// Starts any command in this bench.
    pub fn start_command(&self, mut command: Command) -> Running {
        command
            .current_dir(self.folder.path())
            .env("TMPDIR", self.temporary())
            // what the messages look like must not depend on who runs the test
            .env("NO_COLOR", "1")
            .env("LC_ALL", "C.UTF-8")
            .env_remove("RUST_LOG");
        Running::start(command, &self.temporary())
    }

    /// Runs `vmerack` with these arguments to its end.
    pub fn run(&self, arguments: &[&str]) -> Outcome {
        self.start(arguments).wait()
    }

    /// Runs a scenario for so many simulated seconds with more `options`; it must pass and leave nothing behind. Returns the
    /// digest of its record, as `vmerack log digest` prints it.
    pub fn digest(&self, scenario: &str, seconds: f64, options: &[&str]) -> String {
        let out = tempfile::tempdir_in(self.folder.path()).expect("folder for the run");
        let folder = out.path().to_str().expect("path");
        let seconds = seconds.to_string();
        let arguments = ["run", scenario, "--duration", &seconds, "--out", folder];
        self.run(&[&arguments, options].concat()).expect_code(0).expect_nothing_left();
        self.digest_of(&format!("{folder}/nominal.mcap"))
    }

    /// What `vmerack log digest` prints.
    pub fn digest_of(&self, record: &str) -> String {
        let digest = self.run(&["log", "digest", record]).expect_code(0).stdout.trim().to_owned();
        assert!(digest.len() == 64 && digest.bytes().all(|byte| byte.is_ascii_hexdigit()), "no digest: {digest}");
        digest
    }
}

impl Default for Bench {
    fn default() -> Self {
        Bench::new()
    }
}

/// Sets the element at a key path; tables on the way are made, array elements must exist.
fn set(root: &mut Value, key: &str, value: Value) {
    let mut place = root;
    for part in key.split('.') {
        place = match place {
            Value::Table(table) => table.entry(part).or_insert_with(|| Value::Table(Table::new())),
            Value::Array(array) => {
                let named = array.iter().position(|element| element.get("name").and_then(Value::as_str) == Some(part));
                let index = part.parse().ok().or(named).unwrap_or_else(|| panic!("{key}: no element `{part}`"));
                &mut array[index]
            }
            other => panic!("{key}: {other} has no keys"),
        };
    }
    *place = value;
}
