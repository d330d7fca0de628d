#!/usr/bin/env bash
# Builds the rack and runs every test: ./scripts/test.sh [arguments of `cargo test`]
#
# Sets up what is missing beyond a Rust toolchain. Long runs are in scripts/soak.sh.
set -euo pipefail
cd "$(dirname "$0")/.."
source scripts/setup.sh

# the outside readers of a record
if ! ./scripts/python-env.sh >/dev/null; then
    need_packages python3-venv
    ./scripts/python-env.sh >/dev/null
fi
# the tests of the whole rack start the programs
cargo build --workspace --bins
cargo test --workspace "$@"
