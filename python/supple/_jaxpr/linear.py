"""Products, factorisations and solves of small matrices, written out."""

from __future__ import annotations

from typing import Any

import numpy as np

from . import scalars
from .arrays import Ids, Symbolic
from .tape import Tape, Untranslatable

#: Factorisations of larger matrices are not written out.
LARGEST = 16


def _dot(tape: Tape, a: Any, b: Any) -> int:
    total = tape.constant(0.0)
    for left, right in zip(a, b):
        total = tape.emit("add", total, tape.emit("mul", int(left), int(right)))
    return total


def dot_general(tape: Tape, a: Symbolic, b: Symbolic, numbers: Any) -> Symbolic:
    """A product over some axes, for each place of others."""
    (over_a, over_b), (batch_a, batch_b) = numbers
    free_a = [axis for axis in range(a.ids.ndim) if axis not in (*over_a, *batch_a)]
    free_b = [axis for axis in range(b.ids.ndim) if axis not in (*over_b, *batch_b)]
    left = np.transpose(a.ids, [*batch_a, *free_a, *over_a])
    right = np.transpose(b.ids, [*batch_b, *free_b, *over_b])
    batch, inner = left.shape[: len(batch_a)], int(np.prod([a.shape[axis] for axis in over_a], dtype=int))
    shape_a, shape_b = [a.shape[axis] for axis in free_a], [b.shape[axis] for axis in free_b]
    rows, columns = int(np.prod(shape_a, dtype=int)), int(np.prod(shape_b, dtype=int))
    left, right = left.reshape((*batch, rows, inner)), right.reshape((*batch, columns, inner))
    ids = np.empty((*batch, rows, columns), dtype=np.int64)
    for place in np.ndindex(*batch, rows, columns):
        *group, row, column = place
        ids[place] = _dot(tape, left[(*group, row)], right[(*group, column)])
    return Symbolic(ids.reshape((*batch, *shape_a, *shape_b)), a.kind)


def _matrices(tape: Tape, array: Symbolic, what: str) -> list[Ids]:
    rows, columns = array.shape[-2:]
    if max(rows, columns) > LARGEST:
        raise Untranslatable(
            f"`{tape.name}` needs {what} of {rows} x {columns}; up to {LARGEST} x {LARGEST} are written"
        )
    return list(array.ids.reshape((-1, rows, columns)))


def cholesky(tape: Tape, array: Symbolic) -> Symbolic:
    """Lower factors `L` with `L L'` the matrices, of which the lower halves are read."""
    found = [_cholesky(tape, matrix) for matrix in _matrices(tape, array, "a Cholesky factor")]
    return Symbolic(np.stack(found).reshape(array.shape), "f")


def _cholesky(tape: Tape, matrix: Ids) -> Ids:
    factor = np.full(matrix.shape, tape.constant(0.0), dtype=np.int64)
    for j in range(len(matrix)):
        rest = tape.emit("sub", int(matrix[j, j]), _dot(tape, factor[j, :j], factor[j, :j]))
        factor[j, j] = tape.emit("sqrt", rest)
        for i in range(j + 1, len(matrix)):
            rest = tape.emit("sub", int(matrix[i, j]), _dot(tape, factor[i, :j], factor[j, :j]))
            factor[i, j] = tape.emit("div", rest, int(factor[j, j]))
    return factor


def lu(tape: Tape, array: Symbolic) -> list[Symbolic]:
    """Packed factors, pivots and permutations of matrices, with the rows that LAPACK would choose."""
    if len(set(array.shape[-2:])) > 1:
        raise Untranslatable(f"`{tape.name}` needs the LU factors of a matrix that is not square")
    found = [_lu(tape, matrix.copy()) for matrix in _matrices(tape, array, "LU factors")]
    packed, pivots, order = (np.stack(part) for part in zip(*found))
    batch = array.shape[:-2]
    return [
        Symbolic(packed.reshape(array.shape), "f"),
        Symbolic(pivots.reshape((*batch, -1)), "i"),
        Symbolic(order.reshape((*batch, -1)), "i"),
    ]


def _lu(tape: Tape, rows: Ids) -> tuple[Ids, Ids, Ids]:
    size = len(rows)
    order = np.array([tape.constant(float(i)) for i in range(size)], dtype=np.int64)
    pivots = order.copy()
    for k in range(size):
        _swap_largest(tape, rows, order, pivots, k)
        for i in range(k + 1, size):
            rows[i, k] = tape.emit("div", int(rows[i, k]), int(rows[k, k]))
            for j in range(k + 1, size):
                product = tape.emit("mul", int(rows[i, k]), int(rows[k, j]))
                rows[i, j] = tape.emit("sub", int(rows[i, j]), product)
    return rows, pivots, order


def _swap_largest(tape: Tape, rows: Ids, order: Ids, pivots: Ids, k: int) -> None:
    """Brings the row with the largest entry in column k to place k."""

    def size(value: int) -> int:
        return scalars.choose(tape, value, value, tape.emit("neg", value))

    largest, place = size(int(rows[k, k])), tape.constant(float(k))
    for i in range(k + 1, len(rows)):
        entry = size(int(rows[i, k]))
        wins = scalars.greater(tape, entry, largest)
        largest = scalars.choose(tape, wins, entry, largest)
        place = scalars.choose(tape, wins, tape.constant(float(i)), place)
    pivots[k] = place
    for i in range(k + 1, len(rows)):
        # The place is an integer.
        chosen = scalars.equal(tape, place, tape.constant(float(i)))
        for column in range(rows.shape[1] + 1):
            upper, lower = (int(order[j] if column == rows.shape[1] else rows[j, column]) for j in (k, i))
            swapped = scalars.choose(tape, chosen, lower, upper), scalars.choose(tape, chosen, upper, lower)
            for j, value in zip((k, i), swapped):
                if column == rows.shape[1]:
                    order[j] = value
                else:
                    rows[j, column] = value


def triangular_solve(tape: Tape, a: Symbolic, b: Symbolic, parameters: dict[str, Any]) -> Symbolic:
    """The solution `x` of `op(a) x = b`, or of `x op(a) = b` where `left_side` is false."""
    left, lower = parameters["left_side"], parameters["lower"]
    shape = b.shape
    right = b.ids if left else np.swapaxes(b.ids, -1, -2)
    turned = bool(parameters["transpose_a"]) != (not left)
    matrices = _matrices(tape, a, "a solve")
    found = []
    for matrix, columns in zip(matrices, right.reshape((-1, *right.shape[-2:]))):
        matrix = matrix.T if turned else matrix
        found.append(_substitute(tape, matrix, columns.copy(), lower != turned, parameters["unit_diagonal"]))
    solution = np.stack(found).reshape(right.shape)
    return Symbolic((solution if left else np.swapaxes(solution, -1, -2)).reshape(shape), "f")


def _substitute(tape: Tape, matrix: Ids, columns: Ids, lower: bool, unit: bool) -> Ids:
    size = len(matrix)
    for i in range(size) if lower else range(size - 1, -1, -1):
        done = slice(0, i) if lower else slice(i + 1, size)
        for column in range(columns.shape[1]):
            known = _dot(tape, matrix[i, done], columns[done, column])
            rest = tape.emit("sub", int(columns[i, column]), known)
            columns[i, column] = rest if unit else tape.emit("div", rest, int(matrix[i, i]))
    return columns
