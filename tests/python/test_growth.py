"""Time and memory grow with the size of a task as the documentation says: `benches/python/growth.py` at small sizes."""

from __future__ import annotations

import sys
from pathlib import Path

import pytest
from conftest import ROOT

sys.path.insert(0, str(ROOT / "benches" / "python"))

import growth  # noqa: E402

# Sizes, the least and greatest exponents of seconds, and the greatest one of memory. Parameters cost next to nothing.
SMALL = {
    "joints": ((12, 24, 48), (0.8, 3.5), 2.2),
    "steps": ((2_000, 8_000, 32_000), (0.5, 1.8), 1.2),
    "parameters": ((8, 32, 128), (-2.0, 1.3), 1.2),
    "tasks": ((2, 4, 8), (0.5, 1.6), 1.2),
}


@pytest.mark.parametrize("kind", growth.KINDS, ids=lambda kind: kind.name)
def test_growth_is_no_steeper_than_documented(kind: growth.Kind, program: Path, tmp_path: Path) -> None:
    sizes, (least_time, most_time), most_memory = SMALL[kind.name]
    runs = growth.grown(str(program), kind, sizes, 120.0, tmp_path)
    powers = growth.exponents(runs)
    assert least_time <= powers["seconds"] <= most_time, runs
    assert powers["memory"] <= most_memory, runs


def test_exponents_are_those_of_powers() -> None:
    sizes = (1, 2, 4, 8, 16)
    assert growth.exponent(sizes, [3 * size**2 for size in sizes]) == pytest.approx(2)
    # Small sizes, which start-up dominates, do not count.
    assert growth.exponent(sizes, [7, 7, 4, 8, 16]) == pytest.approx(1)


def test_documented_powers_are_those_of_the_table() -> None:
    text = (ROOT / "docs" / "growth.md").read_text()
    for kind in growth.KINDS:
        row = next(line for line in text.splitlines() if line.startswith(f"| {kind.name}: "))
        assert f"| {kind.sizes[0]} to {kind.sizes[-1]} |" in row
        # The limits of the test above are those that a reader expects of the table.
        powers = [float(part.split("size^")[1].split(" ")[0]) for part in row.split("|") if "size^" in part]
        assert len(powers) == 2
        assert powers[0] <= SMALL[kind.name][1][1] and powers[1] <= SMALL[kind.name][2], row
