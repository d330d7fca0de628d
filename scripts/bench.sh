#!/usr/bin/env bash
# Speed and size of the rack, with the machine's conditions. Wall-clock figures of a shared machine: compare within one
# run. ./scripts/bench.sh [--outside|--outside-only] — with --outside also a table beside Pinocchio and MuJoCo, whose PyPI
# packages it installs into the build folder.
set -euo pipefail
cd "$(dirname "$0")/.."
source scripts/setup.sh
cargo build --release --workspace --bins --examples --quiet
release="${CARGO_TARGET_DIR:-target}/release"
out=$(mktemp -d)
hogs=()
# Every part ends: what takes longer than this many seconds is cut off, and said so.
LIMIT=120
limited() {
    local code=0
    timeout "$LIMIT" "$@" || code=$?
    [ "$code" -ne 124 ] || echo "(cut off after $LIMIT s: $(basename "$1"))" >&2
    return "$code"
}
end() {
    ((${#hogs[@]})) && kill "${hogs[@]}" 2>/dev/null
    rm -rf "$out"
}
trap end EXIT

# the arm's algorithms, a control step and a plant step beside Pinocchio (two builds) and MuJoCo, in one run
outside() {
    local python
    python3 -c 'import venv, ensurepip' 2>/dev/null || need_packages python3 python3-venv
    command -v g++ >/dev/null || need_packages g++
    python=$(timeout 900 ./scripts/python-env.sh outside)
    {
        limited cargo bench --quiet -p arm --bench algorithms | sed 's/^/vmerack /' || true
        limited "$release/examples/control_step" | awk '/^round/ { if (!n || $3 < n) n = $3 } END { print "vmerack control_step", n }' || true
        limited "$release/examples/plant_step" | sed 's/^/vmerack /' || true
        timeout 2400 "$python" scripts/reference/bench_outside.py || echo "outside tools: not to their end" >&2
    } | awk -f scripts/reference/side_by_side.awk
    echo "control_step: Pinocchio's has kinematics, the 7x7 solve and RNEA only, ours AHIC, ERC and wrenches too."
    echo "aba: MuJoCo has none, its forward dynamics (CRB and a factorisation) stand there."
    echo "plant_step: MuJoCo's is rigid and touches nothing, ours has flexible joints, friction and contact."
    echo "tip+rnea: what a control step asks of the arm's model; frozen+fd, nearby: a plant step, the first and the nine after it."
}

echo "machine: $(uname -sr), $(nproc) cores, $(sed -n 's/^model name\t*: //p' /proc/cpuinfo | head -n 1), load $(cut -d' ' -f1-3 /proc/loadavg)"
if [ "${1:-}" = --outside-only ]; then
    outside
    exit
fi

# wall time of the windows of Table 5-3, one variant, best of five, and how many times faster than real time
rack() {
    local name=$1 best=
    shift
    for _ in 1 2 3 4 5; do
        limited "$release/vmerack" run table-5-3 --variant modified --set 'report.sweep=[]' --out "$out" --json "$@" >"$out/stdout.json" || true
        local wall
        wall=$(sed -n 's/^ *"wall_s": \([0-9.]*\),*$/\1/p' "$out/stdout.json" | head -n 1)
        [ -n "$wall" ] || continue
        best=$(awk -v a="$wall" -v b="${best:-$wall}" 'BEGIN { print a + 0 < b + 0 ? a : b }')
    done
    awk -v n="$name" -v w="${best:-nan}" 'BEGIN { printf "%-44s %8.3f s %8.1f x real time\n", n, w, 13 / w }'
}
racks() {
    rack "in one process, recording off$1" --in-process --no-record
    rack "in one process, recording on$1" --in-process
    rack "lock step across processes, recording on$1"
}

echo
echo "Table 5-3, one variant, 13 s, start-up excluded, best of five"
racks ""
for _ in 1 2; do
    (while :; do :; done) &
    hogs+=($!)
done
racks ", two hogs"
kill "${hogs[@]}"
hogs=()

# wall time of the windows of SCENARIO's VARIANT over SECONDS, recording off, best of five
windows() {
    local scenario=$1 variant=$2 seconds=$3 best= wall
    shift 3
    for _ in 1 2 3 4 5; do
        limited "$release/vmerack" run "$scenario" --variant "$variant" --duration "$seconds" --set 'report.sweep=[]' --no-record --out "$out" --json "$@" >"$out/stdout.json" || true
        wall=$(sed -n 's/^ *"wall_s": \([0-9.]*\),*$/\1/p' "$out/stdout.json" | head -n 1)
        [ -n "$wall" ] || continue
        best=$(awk -v a="$wall" -v b="${best:-$wall}" 'BEGIN { print a + 0 < b + 0 ? a : b }')
    done
    echo "${best:-nan}"
}
times() {
    awk -v n="$1" -v w="$2" -v s="$3" 'BEGIN { printf "%-56s %8.3f s %8.1f x real time\n", n, w, s / w }'
}

echo
echo "the timing plane: lock step across processes, recording off"
full=$(windows table-5-3 modified 13)
constant=$(windows table-5-3 modified 13 --set rack.bus.constant_ns=700)
times "bus, processors and interrupts modelled" "$full" 13
times "constant latencies" "$constant" 13
awk -v a="$full" -v b="$constant" 'BEGIN { printf "the model costs %.1f %% (limit 20)\n", 100 * (a / b - 1) }'
times "two cards, the second at 1 kHz (limit 10)" "$(windows processor-time two-cards-1-khz 5)" 5
# a whole control job at every sample of the force card, on a modern board
times "force-card interrupts at 8 kHz (limit 1)" "$(windows table-5-3 modified 3 \
    --set controller.processor=modern --set rack.tasks.control.period_ns=125000 \
    --set 'rack.tasks.control.release={ interrupt = "force-sample" }' \
    --set 'rack.interrupters.force-sample.ticks={ period_ns = 125000 }')" 3
echo "arbiter alone (limit 5 M transfers/s), and the nominal window of the timing plane alone"
limited cargo bench --quiet -p vme --bench bus || true

echo
echo "whole command, 0.005 s of simulated time, seconds of wall time (start-up, report and shut-down)"
for _ in 1 2 3; do
    start=$(date +%s.%N)
    limited "$release/vmerack" run table-5-3 --variant modified --set 'report.sweep=[]' --duration 0.005 --out "$out" --json >/dev/null || true
    awk -v a="$start" -v b="$(date +%s.%N)" 'BEGIN { printf "%.3f\n", b - a }'
done

echo
echo "sweep: runs a minute of a 2-s one-axis scenario (200 Hz control, 2 kHz plant), 500 runs on all cores"
start=$(date +%s.%N)
limited "$release/vmerack" sweep one-axis-delay --variant zeta-1 --set duration_s=2.0 --vary encoder_if.delay_ms=40..90:500 \
    --measure envelope_growth --out "$out/sweep" >/dev/null || true
awk -v a="$start" -v b="$(date +%s.%N)" 'BEGIN { printf "%.0f\n", 500 * 60 / (b - a) }'

echo
echo "greatest resident size of each process in Table 5-3, one variant, MB (limit 50)"
"$release/vmerack" run table-5-3 --variant modified --set 'report.sweep=[]' --out "$out" --json >/dev/null 2>&1 &
rack=$!
while [ -e "/proc/$rack/status" ] && kill -0 "$rack" 2>/dev/null; do
    for pid in $rack $(pgrep -P "$rack"); do
        awk '/^Name/ { name = $2 } /VmHWM/ { print name, $2 / 1024 }' "/proc/$pid/status" 2>/dev/null || true
    done
    sleep 0.02
done >"$out/sizes"
wait "$rack" || true
awk '{ if (!($1 in size)) names[++n] = $1; if ($2 > size[$1]) size[$1] = $2 }
    END { for (i = 1; i <= n; i++) printf "%-20s %6.1f\n", names[i], size[names[i]] }' "$out/sizes"

echo
echo "one control step (FK, J, J̇q̇, AHIC, ERC, RR, inverse dynamics)"
limited "$release/examples/control_step" || true
echo
echo "one hop, 256 bytes, between two processes"
limited "$release/examples/hop" || true
echo
echo "lock step, all processes, empty boards and their data over iceoryx2, best of three"
empty_windows() {
    for bell in yield block spin; do
        for _ in 1 2 3; do VMERACK_BELL=$bell limited "$release/examples/windows" 2 || true; done | sort -k2 -n | tail -n 1
    done
}
empty_windows
for _ in 1 2; do
    (while :; do :; done) &
    hogs+=($!)
done
echo "the same beside two hogs"
empty_windows
kill "${hogs[@]}"
hogs=()

echo
echo "integration of the plant"
limited "$release/examples/integrators" || true
limited "$release/examples/plant_step" || true
if [ "${1:-}" = --outside ]; then
    echo
    outside
fi
