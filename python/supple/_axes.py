"""Figures drawn on matplotlib axes, from the same data as the files."""

from __future__ import annotations

from typing import Any

import numpy as np

from .errors import UsageError

__all__ = ["draw"]

COLOURS = {
    "black": "#000000",
    "grey": "#7f7f7f",
    "blue": "#0072b2",
    "vermilion": "#d55e00",
    "green": "#009e73",
    "purple": "#cc79a7",
    "orange": "#e69f00",
    "sky": "#56b4e9",
}
DASHES = {"solid": "-", "dashed": "--", "dash_dotted": "-.", "dotted": ":"}
MARKERS = {"circle": "o", "square": "s", "triangle": "^", "diamond": "D", "star": "*"}


def draw(figure: dict[str, Any], ax: Any) -> None:
    """Draws each panel of a figure on its own axes object."""
    axes = list(np.ravel(np.asarray(ax, dtype=object)))
    panels = figure["panels"]
    if len(axes) != len(panels):
        titles = ", ".join(f"`{panel['title'] or panel['y']['label']}`" for panel in panels)
        raise UsageError(
            f"ax holds {len(axes)} of matplotlib's axes, and the figure `{figure['name']}` has {len(panels)} panels ({titles}); make them by "
            f"`matplotlib.pyplot.subplots({len(panels)})`"
        )
    for axis, panel in zip(axes, panels):
        if not hasattr(axis, "plot"):
            raise UsageError(f"ax={axis!r}: axes of matplotlib, or a list of them")
        _panel(axis, panel)


def _panel(ax: Any, panel: dict[str, Any]) -> None:
    named: set[str] = set()
    for series in panel["series"]:
        label = series["label"] if series["label"] not in named else None
        named.add(label or "")
        ((shape, content),) = series["shape"].items()
        SHAPES[shape](ax, content, series["style"], label)
    for axis, name in ((panel["x"], "x"), (panel["y"], "y")):
        unit = f", {axis['unit']}" if axis["unit"] else ""
        getattr(ax, f"set_{name}label")(f"{axis['label']}{unit}")
        getattr(ax, f"set_{name}scale")(axis["scale"])
        getattr(ax, f"set_{name}lim")(*axis["range"])
    if panel["title"]:
        ax.set_title(panel["title"])
    if named - {""}:
        ax.legend()


def _looks(style: dict[str, Any], label: str | None) -> dict[str, Any]:
    return {"color": COLOURS[style["colour"]], "alpha": style["opacity"], "label": label}


def _marks(style: dict[str, Any]) -> dict[str, Any]:
    face = COLOURS[style["colour"]] if style["filled"] else "white"
    return {"marker": MARKERS.get(style["marker"] or "", None), "markerfacecolor": face}


def _line(ax: Any, content: dict[str, Any], style: dict[str, Any], label: str | None) -> None:
    broken = {"linestyle": DASHES[style["dash"]], "linewidth": style["width"]}
    ax.plot(content["x"], content["y"], **_looks(style, label), **_marks(style), **broken)


def _points(ax: Any, content: dict[str, Any], style: dict[str, Any], label: str | None) -> None:
    ax.plot(content["x"], content["y"], **_looks(style, label), **_marks(style), linestyle="")


def _band(ax: Any, content: dict[str, Any], style: dict[str, Any], label: str | None) -> None:
    ax.fill_between(content["x"], content["low"], content["high"], **_looks(style, label), linewidth=0.0)


def _outline(ax: Any, content: dict[str, Any], style: dict[str, Any], label: str | None) -> None:
    ax.fill(content["x"], content["y"], **_looks(style, label), linewidth=style["width"])


def _arrow(ax: Any, content: dict[str, Any], style: dict[str, Any], label: str | None) -> None:
    (x, tip_x), (y, tip_y) = content["x"], content["y"]
    looks = {"angles": "xy", "scale_units": "xy", "scale": 1.0, **_looks(style, label)}
    ax.quiver(x, y, tip_x - x, tip_y - y, **looks)


def _bars(ax: Any, content: dict[str, Any], style: dict[str, Any], label: str | None) -> None:
    low, high = np.asarray(content["low"]), np.asarray(content["high"])
    middle = 0.5 * (low + high)
    looks = {**_looks(style, label), "linestyle": "", "capsize": 2.0}
    ax.errorbar(content["x"], middle, yerr=0.5 * (high - low), **looks)


def _vertical(ax: Any, content: dict[str, Any], style: dict[str, Any], label: str | None) -> None:
    ax.axvline(content["x"], linestyle=DASHES[style["dash"]], linewidth=style["width"], **_looks(style, label))


def _horizontal(ax: Any, content: dict[str, Any], style: dict[str, Any], label: str | None) -> None:
    ax.axhline(content["y"], linestyle=DASHES[style["dash"]], linewidth=style["width"], **_looks(style, label))


def _field(ax: Any, content: dict[str, Any], style: dict[str, Any], label: str | None) -> None:
    grid = content["grid"]
    filled = ax.contourf(grid["x"], grid["y"], np.asarray(grid["rows"]), levels=content["levels"], cmap=content["map"])
    ax.figure.colorbar(filled, ax=ax)


def _contour(ax: Any, content: dict[str, Any], style: dict[str, Any], label: str | None) -> None:
    grid = content["grid"]
    looks = {"colors": [COLOURS[style["colour"]]], "linewidths": style["width"], "alpha": style["opacity"]}
    ax.contour(grid["x"], grid["y"], np.asarray(grid["rows"]), levels=[content["level"]], **looks)


SHAPES = {
    "line": _line,
    "points": _points,
    "band": _band,
    "bars": _bars,
    "outline": _outline,
    "arrow": _arrow,
    "vertical": _vertical,
    "horizontal": _horizontal,
    "field": _field,
    "contour": _contour,
}
