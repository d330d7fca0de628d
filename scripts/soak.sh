#!/usr/bin/env bash
# Long versions of the tests, some hours in all: every process of the whole rack, the chassis too, killed and stopped at ROUNDS (50)
# moments each, in lock step and in real time; hostile files and messages, FUZZ_SECONDS (default 120) of each kind; the bus's closed forms at ten
# million transfers, and 10 000 random racks against their bounds; ten minutes in real time at 1 kHz in which no message may be
# lost or counted twice; the whole fault campaign with ten seeds, and an hour in contact without a fault: ./scripts/soak.sh [ROUNDS]
set -euo pipefail
cd "$(dirname "$0")/.."
source scripts/setup.sh

cargo build --workspace --bins
SOAK_ROUNDS="${1:-50}" cargo test -p rack_tests --tests -- --ignored --nocapture --test-threads 1

FUZZ_SECONDS="${FUZZ_SECONDS:-120}" cargo test -p rack_tests --test hostile_files --test hostile_messages -- --nocapture
cargo test --release -p vme -- --ignored --nocapture

cargo build --release --workspace --bins
"${CARGO_TARGET_DIR:-target}/release/vmerack" latency --seconds 600 --rate 1000 --out runs/soak-latency
for seed in {1..10}; do
    "${CARGO_TARGET_DIR:-target}/release/vmerack" faults --seed "$seed" --null-hours "$((seed == 1))" --out "runs/soak-faults-$seed"
done
