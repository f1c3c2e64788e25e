"""What the tests of the package share."""

from __future__ import annotations

import os
import shutil
import signal
from collections.abc import Iterator
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]


@pytest.fixture(autouse=True)
def at_the_root(monkeypatch: pytest.MonkeyPatch) -> None:
    """Tasks are named as in the documentation: from the root of the repository."""
    monkeypatch.chdir(ROOT)


@pytest.fixture(autouse=True)
def interruptible() -> Iterator[None]:
    """Ctrl-C interrupts, also where the tests were started in the background, which ignores it."""
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    yield
    signal.signal(signal.SIGINT, before)


@pytest.fixture(scope="session")
def program() -> Path:
    """The program ``supple``: from ``SUPPLE``, the build, or the path."""
    target = Path(os.environ.get("CARGO_TARGET_DIR", ROOT / "target"))
    places = [os.environ.get("SUPPLE"), str(target / "release" / "supple"), shutil.which("supple")]
    for place in places:
        if place and Path(place).exists():
            return Path(place).resolve()
    pytest.skip("the program `supple` is not built: cargo build --release -p supple-cli")
