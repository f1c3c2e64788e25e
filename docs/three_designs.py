"""Draws docs/images/aims/three.svg: what the robot needs and what its sensors measure, at the designs of least information.

    python docs/three_designs.py docs/images/aims/three.svg

Needs matplotlib and the package supple.
"""

from __future__ import annotations

import sys
from pathlib import Path

import matplotlib
from matplotlib import pyplot as plt

import supple

matplotlib.use("svg")
matplotlib.rcParams["svg.hashsalt"] = "three"
TASKS = Path(__file__).resolve().parent.parent / "tasks"
KINDS = {"needed": ("#2a78b5", "s"), "used": ("#3a9b5c", "^"), "measured": ("#d1702a", "D")}


def bits(found: supple.Evaluation | supple.Design) -> tuple[float, float]:
    """Bits measured and needed."""
    (task,) = found.tasks.values()
    information = task.information
    return information.total_bits, information.needed.total_bits if information.needed else 0.0


def draw(axes: plt.Axes, name: str, title: str, starts: int) -> None:
    """One task: the start and an arrow to each design."""
    task = supple.load(TASKS / f"{name}.toml")
    first = bits(task.evaluate(rollouts=0))
    axes.plot(*first, "o", color="#777777", markersize=7, label="start", zorder=3)
    for kind, (color, marker) in KINDS.items():
        end = bits(task.design(information=kind, starts=starts, rollouts=0))
        arrow = {"arrowstyle": "-|>", "color": color, "lw": 1.2, "shrinkA": 5, "shrinkB": 5}
        axes.annotate("", end, first, arrowprops=arrow)
        axes.plot(*end, marker, color=color, markersize=9 if kind == "used" else 6, label=f"least {kind}", zorder=3)
    axes.set(title=title, xlabel="measured, bits", ylabel="needed, bits", yscale="log")
    axes.margins(0.15)
    axes.grid(visible=True, which="both", alpha=0.25, linewidth=0.5)


def main() -> None:
    """Both tasks beside one another."""
    figure, panels = plt.subplots(1, 2, figsize=(7.1, 3.0), layout="constrained")
    draw(panels[0], "two_mass_unsure", "Two masses, uncertain wall", 4)
    draw(panels[1], "wiping_arm", "Arm that wipes a wall", 2)
    panels[0].legend(fontsize=8)
    figure.savefig(sys.argv[1], metadata={"Date": None})


if __name__ == "__main__":
    main()
