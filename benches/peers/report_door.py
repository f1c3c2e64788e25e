"""The table of benches/compare_door.sh, from what it measured: a folder and the level of instructions."""
import json
import pathlib
import re
import statistics
import sys

STEPS = 500
FOLDER, LEVEL = pathlib.Path(sys.argv[1]), sys.argv[2]


def supple():
    """Medians by name, us."""
    times = {}
    for file in sorted(FOLDER.glob("**/new/benchmark.json")):
        record = json.loads(file.read_text())
        name = record["function_id"] or record["group_id"]
        median = json.loads(file.with_name("estimates.json").read_text())["median"]["point_estimate"]
        times.setdefault(name, []).append(median * 1e-3)
    return {name: statistics.median(medians) for name, medians in times.items()}


def crocoddyl():
    """Medians by name, us; all but `iteration` by one step."""
    times = {}
    for line in (FOLDER / "crocoddyl").read_text().splitlines():
        record = json.loads(line)
        times.setdefault(record["name"], []).append(record["median_us"])
    return {name: statistics.median(medians) for name, medians in times.items()}


def line(name, found, target, met):
    print(f"{name:42} {found:52} {target:22} {'met' if met else 'NOT MET'}")


def faster(name, ours, theirs, unit, aim=""):
    ratio = theirs / ours
    found = f"supple {ours:.3f} {unit}, crocoddyl {theirs:.3f} {unit}: {ratio:.1f} times"
    line(name, found, f"at least 4 times{aim}", ratio >= 4)


def main():
    ours, theirs = supple(), crocoddyl()
    print(f"{LEVEL}, medians; one thread but for the design")
    faster("linearise and cost, by step", ours["linearise"] / STEPS, theirs["calcDiff"], "us")
    faster("Riccati, by step", ours["riccati"] / STEPS, theirs["backwardPass"], "us")
    faster("iteration", ours["iteration"] * 1e-3, theirs["iteration"] * 1e-3, "ms", ", aim 8")
    implicit, semi = ours["integrator/implicit"], ours["integrator/semi_implicit"]
    found = f"{implicit * 1e-3:.3f} ms, semi-implicit {semi * 1e-3:.3f} ms: {100 * (implicit / semi - 1):+.1f} %"
    line("iteration with implicit steps", found, "at most 15 % more", implicit <= 1.15 * semi)
    filtered = ours["kalman_and_information"] / (STEPS + 1)
    line("Kalman and information, by step", f"{filtered:.3f} us", "below 1 us", filtered < 1)
    # With the belief, which they need.
    for name, time in [
        ("total gradient of information", ours["information_gradient"]),
        ("total gradients of information and cost", ours["both_gradients"]),
    ]:
        iterations = time / ours["iteration"]
        line(name, f"{time * 1e-3:.3f} ms: {iterations:.1f} iterations", "within 5 iterations", iterations <= 5)
    design = ours["design_one_start"] * 1e-6
    line("design from one start", f"{design:.2f} s", "below 3 s", design < 3)
    memory = int(re.search(r"Maximum resident set size \(kbytes\): (\d+)", (FOLDER / "time").read_text())[1]) * 1.024e-3
    line("supple design tasks/iiwa_door.toml", f"{memory:.0f} MB at most", "below 200 MB", memory < 200)


if __name__ == "__main__":
    main()
