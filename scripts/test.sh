#!/usr/bin/env bash
# Every test: builds the processes first, since whole-rack tests start them, then runs the workspace's tests.
set -euo pipefail
cd "$(dirname "$0")/.."
source scripts/setup.sh
# the record is read by outside tools in Python
python3 -c 'import venv, ensurepip' 2>/dev/null || need_packages python3 python3-venv
./scripts/python-env.sh >/dev/null

# with the tests, so that packages are built once for both
cargo build --workspace --bins --tests --examples --locked
cargo test --workspace --locked --no-fail-fast "$@"
