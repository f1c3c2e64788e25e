"""``python3 -m supple validate DIR``: the part of the command line that runs in Python."""

from __future__ import annotations

import argparse
import json
import logging
import sys
from pathlib import Path
from typing import Any

from .errors import SuppleError
from .results import Design, Evaluation
from .studies import load_result

__all__ = ["main"]

#: File written into the folder of the result.
VALIDATION = "validation.json"


def main(words: list[str] | None = None) -> int:
    """Runs the command and returns its exit code: 0 on success, 1 if a plan or roll-out failed, 2 if the input is invalid."""
    parser = argparse.ArgumentParser(prog="python3 -m supple", description=__doc__)
    commands = parser.add_subparsers(dest="command", required=True)
    validate = commands.add_parser("validate", help="run a design in closed loop on MuJoCo")
    validate.add_argument("folder", metavar="DIR", help="folder of a result of `supple design` or `supple evaluate`")
    validate.add_argument("--rollouts", type=int, default=200, metavar="N", help="roll-outs of each task (200)")
    validate.add_argument("--contact", choices=["same", "mujoco"], default="same", help="contact law on MuJoCo (same)")
    validate.add_argument("--at", choices=["start", "optimum"], help="design to validate (optimum of a search)")
    validate.add_argument(
        "--vary",
        action="append",
        default=[],
        metavar="NAME=FACTOR",
        help="multiply a quantity of MuJoCo's robot by a factor",
    )
    validate.add_argument("--seed", type=int, default=0, metavar="S", help="seed of the roll-outs (0)")
    validate.add_argument("--json", action="store_true", help="print one JSON object and nothing else")
    given = parser.parse_args(words)
    logging.basicConfig(level=logging.ERROR)
    try:
        return _validate(given)
    except (SuppleError, ImportError, OSError) as error:
        print(f"error: {error}", file=sys.stderr)
        return 2


def _validate(given: argparse.Namespace) -> int:
    from . import mujoco
    from .errors import UsageError

    vary = {}
    for text in given.vary:
        name, _, factor = text.partition("=")
        try:
            vary[name] = float(factor)
        except ValueError:
            raise UsageError(f"--vary {text}: write NAME=FACTOR, such as contact.stiffness=2") from None
    result = load_result(given.folder)
    if not isinstance(result, (Design, Evaluation)):
        raise UsageError(f"{given.folder} holds a result of `{result.kind}`: give one of `design` or `evaluate`")
    found_by = "optimum" if isinstance(result, Design) else "start"
    at: Any = given.at or found_by
    found = mujoco.validate(result, given.rollouts, given.contact, vary, at, given.seed)
    path = found.save(Path(given.folder) / VALIDATION)
    if given.json:
        print(json.dumps(json.loads(path.read_text(encoding="utf-8")), indent=2))
    else:
        print(found)
        print(f"wrote {path}")
    held = all(task.status == "converged" and not task.broken for task in found.tasks.values())
    return 0 if held else 1


if __name__ == "__main__":
    sys.exit(main())
