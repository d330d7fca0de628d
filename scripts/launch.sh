#!/usr/bin/env bash
# Builds the rack and starts its processes on a scenario: ./scripts/launch.sh [SCENARIO] [options of `vmerack run`]
set -euo pipefail
cd "$(dirname "$0")/.."
source scripts/setup.sh

cargo build --release --bins
if [ $# -eq 0 ] || [[ "$1" == -* ]]; then
    set -- table-5-3 "$@"
fi
exec "${CARGO_TARGET_DIR:-target}/release/vmerack" run "$@"
