"""Straight programmes over numbers, as the engine reads them, while they are written."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np
import numpy.typing as npt


class Untranslatable(Exception):
    """A function that cannot be written as a tape: the message says what in it, and in which function."""


def _quotient(a: float, b: float) -> float:
    with np.errstate(all="ignore"):
        return float(np.float64(a) / np.float64(b))


def _safe(function: Callable[[Any], Any]) -> Callable[[float], float]:
    def quiet(a: float) -> float:
        with np.errstate(all="ignore"):
            return float(function(np.float64(a)))

    return quiet


#: What instructions do, by name.
FOLD: dict[str, Callable[..., float]] = {
    "add": lambda a, b: a + b,
    "sub": lambda a, b: a - b,
    "mul": lambda a, b: a * b,
    "div": _quotient,
    "neg": lambda a: -a,
    "recip": lambda a: _quotient(1.0, a),
    "sqrt": _safe(np.sqrt),
    "sin": _safe(np.sin),
    "cos": _safe(np.cos),
    "exp": _safe(np.exp),
    "ln": _safe(np.log),
    "tanh": _safe(np.tanh),
    "exp_m1": _safe(np.expm1),
    "ln_1p": _safe(np.log1p),
    "atan2": math.atan2,
    "select": lambda condition, a, b: a if condition > 0.0 else b,
}

#: A tape longer than this is not worth its compilation.
MOST_INSTRUCTIONS = 400_000


class Tape:
    """A tape that is being written.

    Values are numbers: inputs from 0 on (states, controls, parameters, time step), constants below 0, results after the
    inputs. Equal expressions are one value, and what constants decide is folded.
    """

    def __init__(self, sizes: tuple[int, int, int], name: str) -> None:
        """An empty tape.

        Args:
            sizes: how many states, controls and parameters there are.
            name: the function that it is of, for messages.
        """
        self.sizes = sizes
        self.inputs = sum(sizes) + 1
        self.name = name
        #: Which rules make derivatives of JAX's differ from those of the arithmetic, if any.
        self.own_rules: set[str] = set()
        self._constants: list[float] = []
        self._constant_of: dict[str, int] = {}
        self._results: list[tuple[str, tuple[int, ...]]] = []
        self._known: dict[tuple[str, tuple[int, ...]], int] = {}

    def constant(self, value: float) -> int:
        """The value that is always this number."""
        value = float(value) + 0.0
        key = value.hex()
        if key not in self._constant_of:
            self._constants.append(value)
            self._constant_of[key] = -len(self._constants)
        return self._constant_of[key]

    def known(self, value: int) -> float | None:
        """The number that a value always is, if it is one."""
        return self._constants[-value - 1] if value < 0 else None

    def emit(self, operation: str, *operands: int) -> int:
        """The result of an instruction."""
        simple = self._simplified(operation, operands)
        if simple is not None:
            return simple
        if operation in ("add", "mul") and operands[0] > operands[1]:
            operands = (operands[1], operands[0])
        key = (operation, operands)
        found = self._known.get(key)
        if found is None:
            if len(self._results) >= MOST_INSTRUCTIONS:
                raise Untranslatable(f"`{self.name}` takes more than {MOST_INSTRUCTIONS} instructions when written out")
            found = self.inputs + len(self._results)
            self._results.append(key)
            self._known[key] = found
        return found

    def _simplified(self, operation: str, operands: tuple[int, ...]) -> int | None:
        known = [self.known(operand) for operand in operands]
        numbers = [number for number in known if number is not None]
        if len(numbers) == len(operands):
            return self.constant(FOLD[operation](*numbers))
        if operation == "select":
            a, b = operands[1:]
            if a == b:
                return a
            return None if known[0] is None else (a if known[0] > 0.0 else b)
        if len(operands) != 2:
            if operation == "neg" and operands[0] >= self.inputs:
                inner = self._results[operands[0] - self.inputs]
                return inner[1][0] if inner[0] == "neg" else None
            return None
        return self._simplified_pair(operation, operands, known)

    def _simplified_pair(self, operation: str, operands: tuple[int, ...], known: list[float | None]) -> int | None:
        a, b = operands
        if operation == "add":
            return b if known[0] == 0.0 else (a if known[1] == 0.0 else None)
        if operation == "sub":
            if a == b:
                return self.constant(0.0)
            return a if known[1] == 0.0 else (self.emit("neg", b) if known[0] == 0.0 else None)
        if operation == "mul":
            for number, other in ((known[0], b), (known[1], a)):
                if number == 0.0:
                    return self.constant(0.0)
                if number == 1.0:
                    return other
                if number == -1.0:
                    return self.emit("neg", other)
        if operation == "div" and known[1] == 1.0:
            return a
        return None

    def finished(self, outputs: list[int]) -> dict[str, Any]:
        """The tape with these outputs and only what they need, as the engine reads it.

        Raises:
            Untranslatable: where an infinite constant or one that is not a number is needed.
        """
        order = self._needed(outputs)
        constants = sorted((value for value in order if value < 0), reverse=True)
        for value in constants:
            if not math.isfinite(self._constants[-value - 1]):
                raise Untranslatable(f"`{self.name}` needs the constant {self._constants[-value - 1]}")
        place = {value: value for value in range(self.inputs)}
        place.update({value: self.inputs + i for i, value in enumerate(constants)})
        results = [value for value in order if value >= self.inputs]
        first = self.inputs + len(constants)
        place.update({value: first + i for i, value in enumerate(results)})
        instructions = []
        for value in results:
            operation, operands = self._results[value - self.inputs]
            moved = [place[operand] for operand in operands]
            instructions.append({operation: moved if len(moved) > 1 else moved[0]})
        states, controls, parameters = self.sizes
        return {
            "states": states,
            "controls": controls,
            "parameters": parameters,
            "constants": [self._constants[-value - 1] for value in constants],
            "instructions": instructions,
            "outputs": [place[output] for output in outputs],
        }

    def _needed(self, outputs: list[int]) -> list[int]:
        needed = set(outputs)
        for value in range(self.inputs + len(self._results) - 1, self.inputs - 1, -1):
            if value in needed:
                needed.update(self._results[value - self.inputs][1])
        return sorted(needed)


def evaluate(tape: dict[str, Any], inputs: npt.NDArray[np.float64]) -> npt.NDArray[np.float64]:
    """The outputs (points x outputs) of a finished tape at several points (points x inputs, the time step last)."""
    values: list[Any] = [inputs[:, i] for i in range(inputs.shape[1])]
    values += [np.full(len(inputs), constant) for constant in tape["constants"]]
    with np.errstate(all="ignore"):
        for instruction in tape["instructions"]:
            ((operation, operands),) = instruction.items()
            operands = operands if isinstance(operands, list) else [operands]
            values.append(VALUE[operation](*(values[operand] for operand in operands)))
    columns = [values[output] for output in tape["outputs"]]
    return np.stack(columns, axis=1) if columns else np.zeros((len(inputs), 0))


#: What instructions do to arrays, by name.
VALUE: dict[str, Callable[..., Any]] = {
    "add": np.add,
    "sub": np.subtract,
    "mul": np.multiply,
    "div": np.divide,
    "neg": np.negative,
    "recip": lambda a: 1.0 / a,
    "sqrt": np.sqrt,
    "sin": np.sin,
    "cos": np.cos,
    "exp": np.exp,
    "ln": np.log,
    "tanh": np.tanh,
    "exp_m1": np.expm1,
    "ln_1p": np.log1p,
    "atan2": np.arctan2,
    "select": lambda condition, a, b: np.where(condition > 0.0, a, b),
}
