"""The numbered examples print the same in both languages."""

from __future__ import annotations

import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
EXAMPLES = ROOT / "python" / "examples"
TWINS = ROOT / "crates" / "supple" / "examples"
PAIRS = sorted(path.stem for path in EXAMPLES.glob("[0-9]*.py") if (TWINS / f"{path.stem}.rs").exists())


def built(name: str) -> Path:
    """The example in Rust, as `cargo test` builds it."""
    target = Path(os.environ.get("CARGO_TARGET_DIR", ROOT / "target"))
    path = target / "release" / "examples" / name
    if not path.exists():
        pytest.skip(f"{name} is not built: cargo build --release -p supple --examples")
    return path


@pytest.mark.parametrize("name", PAIRS)
def test_twins_print_the_same(name: str) -> None:
    source = (EXAMPLES / f"{name}.py").read_text()
    for module in re.findall(r"^import (jax|mujoco)", source, re.MULTILINE):
        pytest.importorskip(module)
    rust = subprocess.run([built(name)], capture_output=True, text=True, check=True).stdout
    python = subprocess.run(
        [sys.executable, EXAMPLES / f"{name}.py"], capture_output=True, text=True, check=True
    ).stdout
    assert python == rust


def test_there_are_pairs() -> None:
    assert len(PAIRS) >= 3
    assert [name[:2] for name in PAIRS] == sorted({name[:2] for name in PAIRS})
