//! Where the programs under test lie.

use std::path::{Path, PathBuf};

/// Folder of the profile that the test was built with, for example `target/debug`.
fn profile_folder() -> PathBuf {
    let test = std::env::current_exe().expect("path of the running test");
    // target/debug/deps/test-0123
    test.parent().and_then(Path::parent).expect("the test lies in a target folder").to_path_buf()
}

/// The target folder.
pub fn target_folder() -> PathBuf {
    profile_folder().parent().expect("the profile lies in a target folder").to_path_buf()
}

/// A built program of the workspace.
pub fn program(name: &str) -> PathBuf {
    let path = profile_folder().join(name);
    assert!(
        path.exists(),
        "{} is missing: run scripts/test.sh, or `cargo build --workspace --bins` first",
        path.display()
    );
    path
}

/// Root folder of the workspace.
pub fn workspace() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).parent().expect("tests/ lies in the workspace").to_path_buf()
}
