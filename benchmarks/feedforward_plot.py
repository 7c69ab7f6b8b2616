"""The picture of the benchmark `feedforward`: errors of one motion over time, and of all motions by method."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import matplotlib as mpl
import numpy as np

mpl.use("Agg")
from matplotlib import pyplot as plt

COLOURS = {"plain": "#8a8f98", "fitted": "#d9822b", "diagnosed": "#2b6cb0", "learned": "#2f855a"}
PERIOD = 0.02
MOTION = "sine"


def plot(entries: Sequence[dict[str, Any]], path: Path) -> None:
    """Writes the picture."""
    labels = [label for label in next(iter(entries[0]["runs"].values())) if label.startswith("learned ")]
    worst = max(entries, key=lambda entry: entry["runs"][MOTION]["fitted"]["rms"])
    run = worst["runs"][MOTION]
    figure, (over_time, by_method) = plt.subplots(
        2, 1, figsize=(8.4, 7.2), height_ratios=(1.0, 1.0), layout="constrained"
    )
    joint = int(np.argmax(run["plain"]["by_joint"]))
    for label in ("plain", "fitted", "diagnosed", labels[-1]):
        missed = run[label]["missed"][joint]
        colour = COLOURS[label.split()[0]]
        over_time.plot(PERIOD * np.arange(len(missed)), missed, color=colour, label=label, linewidth=1.2)
    over_time.set(
        xlabel="time (s)",
        ylabel=f"wanted − read, joint {joint + 1} (°)",
        title=f"{MOTION}, the arm on which the fitted model did worst\n{', '.join(worst['hidden'])}",
    )
    over_time.title.set_fontsize(9)
    over_time.legend(ncols=4, frameon=False, loc="upper center", bbox_to_anchor=(0.5, -0.16))
    methods = ["plain", "fitted", "diagnosed", "diagnosed, learned once", *labels]
    for entry in entries:
        rms = [np.sqrt(np.mean([r[label]["rms"] ** 2 for r in entry["runs"].values()])) for label in methods]
        by_method.plot(range(4), rms[:4], "o", color="#4a5568", alpha=0.7)
        by_method.plot(range(4, len(methods)), rms[4:], "o-", color=COLOURS["learned"], alpha=0.6, linewidth=1)
    by_method.set_yscale("log")
    by_method.set_xticks(range(len(methods)), [m.replace(", ", ",\n") for m in methods], rotation=0, fontsize=8)
    by_method.set(ylabel="rms error, all motions (°)", title=f"{len(entries)} arms, a dot each")
    by_method.title.set_fontsize(10)
    for axes in (over_time, by_method):
        axes.grid(visible=True, alpha=0.25)
        axes.spines[["top", "right"]].set_visible(False)
    figure.savefig(path, dpi=130)
    plt.close(figure)
