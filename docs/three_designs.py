"""Draws docs/images/aims/three.svg: what three tasks need, use and measure at the designs of least information.

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
#: Information, colour and marker.
KINDS = {"needed": ("#2a78b5", "s"), "used": ("#3a9b5c", "^"), "measured": ("#d1702a", "D")}
#: Measured information is hollow, so that used information of about as many bits can be seen in it.
SIZES = {"needed": 6, "used": 5, "measured": 9}
#: Task, title and number of starts.
PANELS = [
    ("two_mass_unsure", "Two masses, uncertain wall", 4),
    ("wiping_arm", "Arm that wipes a wall", 2),
    ("iiwa_door", "Door: nothing is needed", 1),
]
#: Bits below which the axis is linear, so that 0 can be shown.
LINEAR = 0.1


def bits(found: supple.Evaluation | supple.Design) -> dict[str, float]:
    """Bits needed, used and measured, summed over the tasks."""
    reports = [task.information for task in found.tasks.values()]
    return {
        "needed": sum(report.needed.total_bits for report in reports),
        "used": sum(report.used.total_bits for report in reports),
        "measured": sum(report.total_bits for report in reports),
    }


def costs(found: supple.Evaluation | supple.Design) -> str:
    """The sampled cost of each task."""
    return ", ".join(f"{task.monte_carlo.cost_mean:.1f}" for task in found.tasks.values())


def draw(axes: plt.Axes, name: str, title: str, starts: int) -> None:
    """One task: a row for the start and for each design."""
    task = supple.load(TASKS / f"{name}.toml")
    designs = {"start": task.evaluate()}
    # Where no information is needed, a search for the least needed is one for the least used.
    for kind in ("needed", "used", "measured"):
        designs[f"least {kind}"] = task.design(information=kind, starts=starts)
    for row, found in enumerate(designs.values()):
        shown = bits(found)
        axes.plot([shown["needed"], shown["measured"]], [row, row], color="#bbbbbb", linewidth=1, zorder=1)
        for kind, (color, marker) in KINDS.items():
            style = {"color": color, "markersize": SIZES[kind], "fillstyle": "none" if kind == "measured" else "full"}
            axes.plot(shown[kind], row, marker, **style, label=kind if row == 0 else None, linestyle="none", zorder=3)
        place = {"transform": axes.get_yaxis_transform(), "fontsize": 7, "color": "#555555"}
        axes.text(0.02, row - 0.3, f"cost {costs(found)}", **place)
    axes.set(title=title, xlabel="information, bits", yticks=range(len(designs)), yticklabels=list(designs))
    axes.set_xscale("symlog", linthresh=LINEAR, linscale=0.5)
    axes.set_xticks([0, 0.1, 1, 10, 100, 1000], ["0", "0.1", "1", "10", "100", "1000"])
    axes.set_xlim(-0.03, 9000)
    axes.set_ylim(len(designs) - 0.5, -0.6)
    axes.grid(visible=True, axis="x", alpha=0.25, linewidth=0.5)
    axes.title.set_fontsize(9)
    axes.tick_params(labelsize=8)


def main() -> None:
    """The tasks beside one another."""
    figure, panels = plt.subplots(1, 3, figsize=(9.4, 2.9), layout="constrained", sharey=True)
    for axes, panel in zip(panels, PANELS, strict=True):
        draw(axes, *panel)
    figure.legend(*panels[0].get_legend_handles_labels(), loc="outside lower center", ncols=3, fontsize=8, frameon=False)
    figure.savefig(sys.argv[1], metadata={"Date": None})


if __name__ == "__main__":
    main()
