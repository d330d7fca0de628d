#!/usr/bin/env bash
# Latency and jitter of the rack on this machine at 1 kHz, idle and under load, with the cost of measuring:
# ./scripts/measure-latency.sh [SECONDS] [DIR]
set -euo pipefail
cd "$(dirname "$0")/.."
source scripts/setup.sh
cargo build --release --workspace --bins --quiet
vmerack="${CARGO_TARGET_DIR:-target}/release/vmerack"
seconds="${1:-10}"
out="${2:-runs/latency}"

"$vmerack" doctor
echo
"$vmerack" latency --seconds "$seconds" --rate 1000 --cost --out "$out/idle"
echo
"$vmerack" latency --seconds "$seconds" --rate 1000 --load --out "$out/load"
