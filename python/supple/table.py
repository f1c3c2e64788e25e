"""Tables: columns by name."""

from __future__ import annotations

import html
from collections.abc import Iterator, Mapping
from typing import Any

from .errors import UsageError

__all__ = ["Table"]


class Table(Mapping[str, Any]):
    """Named columns of equal length: arrays of numbers, NaN where there is none, or lists of texts."""

    def __init__(self, columns: Mapping[str, Any], units: Mapping[str, str], descriptions: Mapping[str, str]) -> None:
        self._columns = dict(columns)
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
            raise KeyError(f"there is no column `{name}`: there is {', '.join(self._columns)}") from None

    def __iter__(self) -> Iterator[str]:
        return iter(self._columns)

    def __len__(self) -> int:
        """How many rows there are."""
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
        return pandas.DataFrame(self._columns)

    def to_polars(self) -> Any:
        """A polars ``DataFrame``."""
        try:
            import polars
        except ImportError as error:
            raise UsageError("to_polars() needs polars: pip install polars") from error
        return polars.DataFrame(self._columns)

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


def _text(value: object) -> str:
    if isinstance(value, float):
        return f"{value:.6g}"
    return "" if value is None else html.escape(str(value))
