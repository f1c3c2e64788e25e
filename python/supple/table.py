"""Tables: columns by name."""

from __future__ import annotations

import html
from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np

from .errors import UsageError

__all__ = ["Table", "dataset"]


class _NoColumn(UsageError, KeyError):
    """A mapping's error for an unknown key, with the message as it is."""

    def __str__(self) -> str:
        return str(self.args[0])


class Table(Mapping[str, Any]):
    """Named columns of equal length: arrays of numbers, integers or booleans, or lists of strings.

    Missing numbers are NaN. Integer and boolean columns with missing values are stored as numbers; in a pandas or polars
    frame they keep their type, with missing values.
    """

    def __init__(
        self,
        columns: Mapping[str, Any],
        units: Mapping[str, str],
        descriptions: Mapping[str, str],
        kinds: Mapping[str, str] | None = None,
    ) -> None:
        self._columns = dict(columns)
        self._kinds = dict(kinds or {})
        self.units = dict(units)
        self.descriptions = dict(descriptions)

    @property
    def columns(self) -> list[str]:
        """Names of the columns."""
        return list(self._columns)

    def __getitem__(self, name: str) -> Any:
        try:
            return self._columns[name]
        except KeyError:
            raise _NoColumn(f"no column `{name}`; valid: {', '.join(self._columns)}") from None

    def __iter__(self) -> Iterator[str]:
        return iter(self._columns)

    def __len__(self) -> int:
        """Number of rows."""
        return len(next(iter(self._columns.values()), ()))

    def to_dict(self) -> dict[str, list[Any]]:
        """Columns as lists."""
        return {name: list(column) for name, column in self._columns.items()}

    def to_pandas(self) -> Any:
        """A pandas ``DataFrame``."""
        try:
            import pandas
        except ImportError as error:
            raise UsageError("to_pandas() needs pandas: pip install pandas") from error
        types = {"counts": "Int64", "truths": "boolean"}
        frame = pandas.DataFrame(self._columns)
        return frame.astype({name: types[self._kinds[name]] for name in self._gaps()})

    def to_polars(self) -> Any:
        """A polars ``DataFrame``."""
        try:
            import polars
        except ImportError as error:
            raise UsageError("to_polars() needs polars: pip install polars") from error
        types = {"counts": polars.Int64, "truths": polars.Boolean}
        frame = polars.DataFrame(self._columns, nan_to_null=False)
        gaps = (polars.col(name).fill_nan(None).cast(types[self._kinds[name]]) for name in self._gaps())
        return frame.with_columns(*gaps)

    def to_xarray(self) -> Any:
        """An xarray ``Dataset`` along ``row``, with units and descriptions as attributes."""
        return dataset({name: ("row", self[name]) for name in self}, self.units, self.descriptions)

    def _gaps(self) -> list[str]:
        """Integer and boolean columns with missing values."""
        missing = [name for name, kind in self._kinds.items() if kind in ("counts", "truths")]
        return [name for name in missing if getattr(self._columns[name], "dtype", None) == np.float64]

    def __repr__(self) -> str:
        return f"Table of {len(self)} rows: {', '.join(self._columns)}"

    def _repr_html_(self, most: int = 10) -> str:
        head = "".join(f"<th>{html.escape(name)}</th>" for name in self._columns)
        rows = (
            "".join(f"<td>{_text(column[row])}</td>" for column in self._columns.values())
            for row in range(min(most, len(self)))
        )
        body = "".join(f"<tr>{row}</tr>" for row in rows)
        rest = f"<p>{len(self) - most} rows more</p>" if len(self) > most else ""
        return f"<table><thead><tr>{head}</tr></thead><tbody>{body}</tbody></table>{rest}"


def dataset(
    variables: Mapping[str, tuple[Any, Any]],
    units: Mapping[str, str],
    descriptions: Mapping[str, str],
    coordinates: Mapping[str, Any] | None = None,
) -> Any:
    """An xarray ``Dataset`` of variables with their axes, with units and descriptions as attributes."""
    try:
        import xarray
    except ImportError as error:
        raise UsageError("to_xarray() needs xarray: pip install xarray") from error
    found = xarray.Dataset(
        {
            name: (axes, np.asarray(values, dtype=object) if isinstance(values, list) else values)
            for name, (axes, values) in variables.items()
        },
        coords=dict(coordinates or {}),
    )
    for name in (*found.data_vars, *found.coords):
        for key, words in (("units", units), ("description", descriptions)):
            if words.get(str(name)):
                found[name].attrs[key] = words[str(name)]
    return found


def _text(value: object) -> str:
    if isinstance(value, float):
        return f"{value:.6g}"
    return "" if value is None else html.escape(str(value))
