#!/usr/bin/env bash
# Times the two-mass system here and in JAX, alternately on one core, and prints the ratios of medians.
set -euo pipefail
cd "$(dirname "$0")/.."
python=${PYTHON:-python3}
core=${CORE:-0}
rounds=${ROUNDS:-3}
bench=$(cargo bench -p supple --bench two_mass --no-run --message-format=json 2>/dev/null |
    "$python" -c 'import sys, json
for line in sys.stdin:
    m = json.loads(line)
    if m.get("executable") and m["target"]["name"] == "two_mass": print(m["executable"])')
out=$(mktemp -d)
trap 'rm -rf "$out"' EXIT
for _ in $(seq "$rounds"); do
    (cd crates/supple && CRITERION_HOME="$out/criterion" taskset -c "$core" "$bench" --bench two_mass_small/ 2>&1) >>"$out/supple"
    taskset -c "$core" "$python" benches/peers/jax_two_mass.py --unroll 1 5 --reps 200 >>"$out/jax"
done
"$python" - "$out" <<'P'
import json, re, statistics, sys
out = sys.argv[1]
unit = {"ns": 1e-3, "µs": 1.0, "us": 1.0, "ms": 1e3}
text = open(f"{out}/supple").read()
ours = {}
for name, number, u in re.findall(r"two_mass_small/(\w+)\s+time:\s+\[\S+ \S+ (\S+) (\S+) ", text):
    ours.setdefault(name, []).append(float(number) * unit[u])
ours = {name: statistics.median(times) for name, times in ours.items()}
jax = {}
for line in open(f"{out}/jax"):
    r = json.loads(line)
    jax.setdefault(r["name"], {}).setdefault(r.get("unroll"), []).append(r["median_us"])
jax = {name: min(statistics.median(t) for t in by.values()) for name, by in jax.items()}
pairs = [
    ("iLQG iteration", ours["ilqg_iteration"], jax["ilqg_iteration"]),
    ("information and its frozen gradient", ours["di_value_and_frozen_gradient"],
     min(jax["di_value_and_grad"], jax["di_value_and_grad.forward"])),
]
for name, a, b in pairs:
    print(f"{name}: supple {a:.1f} us, JAX {b:.1f} us (medians): {b / a:.1f} times faster")
P
