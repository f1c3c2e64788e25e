"""Every record that results are made of says what its attributes are."""

from __future__ import annotations

import dataclasses
import importlib
import inspect
import pkgutil

import supple
from supple._records import Record


def records() -> list[type[Record]]:
    """All kinds of records, of all modules that need no other package."""
    for module in pkgutil.iter_modules(supple.__path__, "supple."):
        if module.name not in ("supple.mujoco", "supple._mujoco"):
            importlib.import_module(module.name)
    found: list[type[Record]] = []
    kinds = [Record]
    while kinds:
        below = [kind for above in kinds for kind in above.__subclasses__()]
        found, kinds = found + below, below
    return found


def test_every_attribute_of_a_record_is_documented() -> None:
    assert len(records()) > 30
    for kind in records():
        text = inspect.getdoc(kind) or ""
        missing = [field.name for field in dataclasses.fields(kind) if f"    {field.name}: " not in text]
        assert not missing, f"{kind.__name__}: {missing}"
