#!/usr/bin/env bash
# Times the door task here and in crocoddyl, alternately on one core, prints the ratios of medians, and says of each
# target whether it is met.
set -euo pipefail
cd "$(dirname "$0")/.."
python=${PYTHON:-python3}
core=${CORE:-0}
rounds=${ROUNDS:-3}
bench=$(cargo bench -p supple --bench door --no-run --message-format=json 2>/dev/null |
    "$python" -c 'import sys, json
for line in sys.stdin:
    m = json.loads(line)
    if m.get("executable") and m["target"]["name"] == "door": print(m["executable"])')
program=$(cargo build --release -p supple-cli --message-format=json 2>/dev/null |
    "$python" -c 'import sys, json
for line in sys.stdin:
    m = json.loads(line)
    if m.get("executable"): print(m["executable"])')
# The level that is chosen at run time is the last one that the benchmark has.
level=${LEVEL:-$("$bench" --bench --list | sed -n 's|^door/\(.*\)/iteration: .*|\1|p' | tail -1)}
out=$(mktemp -d)
trap 'rm -rf "$out"' EXIT
short=(--bench --noplot --warm-up-time 0.5 --measurement-time "${SECONDS_EACH:-2}")
for round in $(seq "$rounds"); do
    echo "round $round of $rounds" >&2
    CRITERION_HOME="$out/$round" taskset -c "$core" "$bench" "${short[@]}" "door/$level/|integrator/" >"$out/log" 2>&1
    taskset -c "$core" "$python" benches/peers/crocoddyl_door.py >>"$out/crocoddyl"
done
echo "designs" >&2
CRITERION_HOME="$out/whole" "$bench" --bench --noplot door/design_one_start >"$out/log" 2>&1
# 1 is the exit code of a design that does not converge: its memory counts all the same.
/usr/bin/time -v -o "$out/time" "$program" design tasks/iiwa_door.toml --json >"$out/design" 2>"$out/log" || [ $? = 1 ]
"$python" benches/peers/report_door.py "$out" "$level"
