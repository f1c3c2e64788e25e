"""Every MJCF file of the packages ``dm_control`` and ``gymnasium`` is parsed, with the dynamics that MuJoCo computes, or
refused for a reason that names the line and what is missing.

The packages are searched for files and not imported: ``pip install --no-deps dm_control gymnasium`` suffices.
"""

from __future__ import annotations

import importlib.util
import json
import re
import subprocess
from collections import Counter
from pathlib import Path
from typing import Any

import numpy as np
import pytest

mujoco = pytest.importorskip("mujoco")

#: Error relative to the largest number compared.
TOLERANCE = 1e-9
#: Speed over which the program smooths Coulomb friction, rad/s or m/s.
SMOOTHING = 1e-2
#: How many states are compared.
STATES = 3

#: What each reason to refuse a file begins with, and how it is called in the table.
REASONS = {
    r"floating bases are not supported: joint `.+` lets .+ move freely": "floating base",
    r"ball joints are not supported: joint `.+` is one": "ball joint",
    r"the mass of its body would follow from this mesh, and meshes are not read": "inertia from a mesh",
    r"there is no `worldbody` in it": "settings for other files",
    r"the included file `.+` does not exist": "included file is missing",
    r"an equality of type `tendon` is not supported": "equality of tendons",
    r"`(connect|weld)` closes a loop of bodies, which is not supported": "closed loop",
}


def packages() -> list[Path]:
    found = [importlib.util.find_spec(name) for name in ("dm_control", "gymnasium")]
    return [Path(spec.origin).parent for spec in found if spec is not None and spec.origin]


def files() -> list[Path]:
    every = (path for package in packages() for path in sorted(package.rglob("*.xml")))
    return [path for path in every if re.search(r"<mujoco\b", path.read_text(encoding="utf-8"))]


FILES = files()
#: Outcome of each file, for the table.
OUTCOMES: dict[str, str] = {}


def label(path: Path) -> str:
    package = next(package for package in packages() if path.is_relative_to(package))
    return str(path.relative_to(package.parent))


def run(program: Path, path: Path, *words: str) -> subprocess.CompletedProcess[str]:
    command = [program, "robot", str(path), *words]
    return subprocess.run(command, check=False, capture_output=True, text=True, timeout=60)


def listed(numbers: np.ndarray) -> str:
    return ",".join(repr(float(number)) for number in numbers)


def without_what_is_ignored(model: Any) -> None:
    """Leaves out of MuJoCo's model what the program warns that it ignores, and constraints."""
    off = mujoco.mjtDisableBit
    for name in ("CONTACT", "LIMIT", "EQUALITY", "FRICTIONLOSS"):
        model.opt.disableflags |= int(getattr(off, f"mjDSBL_{name}"))
    model.opt.density, model.opt.viscosity, model.opt.wind[:] = 0, 0, 0
    model.body_gravcomp[:] = 0
    model.tendon_stiffness[:], model.tendon_damping[:], model.tendon_armature[:] = 0, 0, 0


def relative_error(found: np.ndarray, expected: np.ndarray) -> float:
    largest = np.max(np.abs(expected))
    return float(np.max(np.abs(found - expected)) / (largest if largest > 0 else 1.0))


def compare(program: Path, path: Path, model: Any) -> None:
    """Mass matrix and inverse dynamics at random states."""
    without_what_is_ignored(model)
    falls = not model.opt.disableflags & int(mujoco.mjtDisableBit.mjDSBL_GRAVITY)
    gravity = listed(model.opt.gravity if falls else np.zeros(3))
    data = mujoco.MjData(model)
    random = np.random.default_rng(1)
    for _ in range(STATES):
        data.qpos = model.qpos0 + random.uniform(-0.7, 0.7, model.nq)
        data.qvel, data.qacc = random.uniform(-1, 1, model.nv), random.uniform(-1, 1, model.nv)
        acceleration = data.qacc.copy()
        mujoco.mj_inverse(model, data)
        expected_mass = np.zeros((model.nv, model.nv))
        mujoco.mj_fullM(model, data, expected_mass)
        words = ["--independent-mimic", f"--gravity={gravity}"]
        found = run(program, path, "--json", *words, f"--q={listed(data.qpos)}", f"--v={listed(data.qvel)}")
        assert found.returncode == 0, found.stderr
        dynamics = json.loads(found.stdout)
        names = [model.joint(i).name or f"joint{i}" for i in range(model.njnt)]
        assert dynamics["joints"] == names
        mass = np.array(dynamics["mass_matrix"]).reshape(model.nv, model.nv)
        assert relative_error(mass, expected_mass) < TOLERANCE, label(path)
        # The program smooths Coulomb friction, which is a constraint in MuJoCo.
        friction = model.dof_frictionloss * data.qvel / np.hypot(data.qvel, SMOOTHING)
        forces = mass @ acceleration + np.array(dynamics["bias"]) - friction
        assert relative_error(forces, data.qfrc_inverse) < TOLERANCE, label(path)


def refused(text: str, path: Path) -> str:
    """The reason in an error, which names a file, a line and what is missing."""
    first = text.splitlines()[0]
    assert "panicked" not in text
    assert re.match(rf"error: {re.escape(str(path.parent))}.*\.xml:[1-9]\d*:[1-9]\d*: ", first), text
    reasons = [name for pattern, name in REASONS.items() if re.search(pattern, first)]
    assert len(reasons) == 1, first
    return reasons[0]


@pytest.mark.skipif(not FILES, reason="neither dm_control nor gymnasium is installed")
@pytest.mark.parametrize("path", FILES, ids=label)
def test_file_is_parsed_with_its_dynamics_or_refused_for_a_reason(program: Path, path: Path) -> None:
    page = run(program, path)
    assert page.returncode in (0, 2), page.stderr
    if page.returncode == 2:
        OUTCOMES[label(path)] = f"refused: {refused(page.stderr, path)}"
        return
    try:
        model = mujoco.MjModel.from_xml_path(str(path))
    except ValueError as error:
        # MuJoCo reads the files of textures, and wants what they name in the file to be there.
        OUTCOMES[label(path)] = "parsed; MuJoCo does not: " + str(error).splitlines()[0][:60]
        return
    if model.nv == 0:
        OUTCOMES[label(path)] = "parsed; no joint moves"
        return
    compare(program, path, model)
    OUTCOMES[label(path)] = "parsed; dynamics as MuJoCo's"


@pytest.mark.skipif(not FILES, reason="neither dm_control nor gymnasium is installed")
def test_table_of_outcomes(capsys: pytest.CaptureFixture[str]) -> None:
    """The table of all files. More than a third have their dynamics compared."""
    if len(OUTCOMES) < len(FILES):
        pytest.skip("not all files were tested")
    with capsys.disabled():
        print(f"\n{len(FILES)} MJCF files")
        for outcome, count in Counter(OUTCOMES.values()).most_common():
            print(f"{count:4}  {outcome}")
        for name, outcome in OUTCOMES.items():
            print(f"  {name}: {outcome}")
    compared = sum(outcome == "parsed; dynamics as MuJoCo's" for outcome in OUTCOMES.values())
    assert compared > len(FILES) // 3
