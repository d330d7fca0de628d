#!/usr/bin/env bash
# Long versions of the tests of the whole rack (every process killed and stopped at many moments): ./scripts/soak.sh [ROUNDS]
set -euo pipefail
cd "$(dirname "$0")/.."
source scripts/setup.sh

cargo build --workspace --bins
SOAK_ROUNDS="${1:-5}" cargo test -p rack_tests --tests -- --ignored --nocapture --test-threads 1
