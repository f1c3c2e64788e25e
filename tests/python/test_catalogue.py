"""Parameters with catalogues: designs that take only values that can be had."""

from __future__ import annotations

import itertools
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import supple

TASKS = Path(__file__).resolve().parents[2] / "tasks"
ENTRIES = '[{ value = 150, price = 3.5, name = "S150" }, { value = 400, price = 2.0 }, 80]'


def two_masses(first: str, second: str = "") -> supple.Task:
    """The two masses with these catalogues of springs."""
    parts = (TASKS / "two_mass.toml").read_text().split('unit = "N/m"')
    texts = [f'unit = "N/m"\ncatalogue = {given}' if given else 'unit = "N/m"' for given in (first, second)]
    return supple.loads(parts[0] + texts[0] + parts[1] + texts[1] + parts[2])


def test_design_takes_entries_only() -> None:
    values = [150.0, 400.0], [150.0, 330.0, 500.0]
    task = two_masses("[400, 150]", "[150, 330, 500]")
    assert [entry.value for entry in task.parameters["k1"].catalogue] == [150.0, 400.0]  # type: ignore[union-attr]
    found = task.design(starts=1)
    chosen = found.catalogue
    assert chosen is not None
    assert (chosen.method, chosen.combinations, chosen.designed, chosen.complete) == ("all_combinations", 6, 6, True)
    best = None
    for k1, k2 in itertools.product(*values):
        at = task.evaluate(k1=k1, k2=k2)
        if at.feasible and (best is None or at.information.bits < best[0]):
            best = at.information.bits, k1, k2
    assert best is not None
    assert (found.parameters["k1"], found.parameters["k2"]) == best[1:]
    # The design looks for cheaper local minima of the plan, which the evaluation does not.
    np.testing.assert_allclose(found.information.bits, best[0], rtol=1e-4)
    assert chosen.gap_bits is not None and chosen.gap_bits > 0.0
    np.testing.assert_allclose(chosen.continuous.information_bits + chosen.gap_bits, found.information.bits)
    assert chosen.best[0].parameters == found.parameters
    assert "more than without catalogues" in str(found._summary())


def test_prices_and_names() -> None:
    found = two_masses(ENTRIES).design(starts=1)
    assert found.catalogue is not None
    (entry,) = found.catalogue.chosen
    expected = {150.0: (3.5, "S150", 3.5), 400.0: (2.0, None, 2.0), 80.0: (None, None, None)}
    assert (entry.price, entry.name, found.catalogue.price) == expected[entry.value]
    assert found.parameters["k1"] == entry.value
    assert found.to_dict()["catalogue"]["chosen"][0]["value"] == entry.value


def test_without_catalogues_there_is_no_report() -> None:
    found = two_masses("").design(starts=1)
    assert found.catalogue is None and "catalogue" not in found.to_dict()


def own(catalogue: Any) -> supple.Task:
    """An own model whose stiffness comes from a catalogue."""
    model = supple.Model(
        step=lambda x, u, p: x + 0.1 * (u - p.stiffness * x),
        observe=lambda x, p: x,
        cost=lambda x, u, p: (x[..., 0] - 1.0) ** 2 + 0.01 * u[..., 0] ** 2,
        states=1,
        controls=1,
        measurements=1,
        parameters={"stiffness": supple.Parameter(1.0, (0.1, 3.0), catalogue=catalogue)},
        backend="numpy",
    )
    noise = supple.Noise(initial=[0.1], process=[0.01], measurement=[0.05])
    return model.task(steps=20, time_step=0.1, initial_state=[0.0], initial_control=[0.0], noise=noise)


def test_own_models() -> None:
    task = own([2.0, supple.CatalogueEntry(0.5, 1.25, "soft")])
    found = task.design(starts=1)
    bits = {value: task.evaluate(stiffness=value).information.bits for value in (0.5, 2.0)}
    best = min(bits, key=lambda value: bits[value])
    assert found.parameters["stiffness"] == best
    np.testing.assert_allclose(found.information.bits, bits[best], rtol=1e-9)


def test_what_is_wrong() -> None:
    for catalogue, message in [
        ([5.0], "entry 1: must be within the bounds [0.1, 3]; found 5"),
        ([1.0, 1.0], "entry 2: the value 1 occurs twice"),
        (["soft"], "a number, or supple.CatalogueEntry(value, price, name)"),
        ([supple.CatalogueEntry(1.0, float("nan"))], "price is not finite"),
        ([supple.CatalogueEntry(1.0, -2.0)], "a price must be a number of at least 0; found -2"),
    ]:
        with pytest.raises(supple.UsageError) as raised:
            own(catalogue)
        assert message in str(raised.value), str(raised.value)
