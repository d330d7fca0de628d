#!/usr/bin/env bash
# Long versions of the tests of the whole rack: every process killed and stopped at many moments; ten minutes in real time at
# 1 kHz in which no message may be lost or counted twice: ./scripts/soak.sh [ROUNDS]
set -euo pipefail
cd "$(dirname "$0")/.."
source scripts/setup.sh

cargo build --workspace --bins
SOAK_ROUNDS="${1:-5}" cargo test -p rack_tests --tests -- --ignored --nocapture --test-threads 1

cargo build --release --workspace --bins
"${CARGO_TARGET_DIR:-target}/release/vmerack" latency --seconds 600 --rate 1000 --out runs/soak-latency
