"""Plans from nothing: the problems of `benches/python/planning_problems.py` that need no other package's robots."""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

import pytest
from conftest import ROOT

sys.path.insert(0, str(ROOT / "benches" / "python"))

import globalisation  # noqa: E402
import planning_problems as families  # noqa: E402

PROBLEMS = [
    *families.swing_ups(),
    *families.pendulums(),
    *families.chains(),
    families.bushing("bushing_soft", 2e3),
    families.bushing("bushing_stiff", 1e5),
    *families.contacts(),
]


@pytest.mark.parametrize("problem", PROBLEMS, ids=lambda problem: problem.name)
def test_problems_are_solved_from_nothing(problem, program: Path, tmp_path: Path) -> None:
    alone = argparse.Namespace(alone=True, limit=30)
    row = globalisation.measured(globalisation.Program(str(program)), problem, tmp_path, alone)
    assert row.supple.solved, row.supple
