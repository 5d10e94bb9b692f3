"""Pictures of what a fit is worth."""

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from symfric.foundation.panels import grid, panels, save
from symfric.foundation.style import colour

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from identification.verdict.profile import Profile


def plot_profile(found: "Profile", path: str | Path | None = None) -> "Figure":
    """The rise of the cost over the value, with the limit of 95 %."""
    figure, (axis,) = panels(1, width=5.5, height=3.2)
    axis.plot(found.values, found.rise, "o-", ms=4, lw=1.3, label="profile")
    axis.axhline(found.limit, color=colour(1), lw=1, ls="--", label="limit of 95 %")
    axis.plot([found.best], [0.0], "k|", ms=14, label="fit")
    for end in (found.low, found.high):
        if end is not None:
            axis.axvline(end, color=colour(1), lw=0.8, ls=":")
    if found.logarithmic and found.values.max() > 5 * found.values.min():
        axis.set_xscale("log")
    top = max(1.6 * found.limit, 0.0)
    axis.set_ylim(min(float(found.rise.min()), 0.0) - 0.05 * top, top)
    axis.set_xlabel(f"{found.name} [{found.unit}]")
    axis.set_ylabel("rise of the cost, in variances")
    axis.set_title("\n".join(found.sentences), fontsize="small", wrap=True)
    axis.legend(fontsize="small")
    return save(figure, path)


def plot_ranking(found: Mapping[str, Any], path: str | Path | None = None) -> "Figure":
    """Errors and BIC of several laws, a bar for each, the best one on top."""
    rows = [row for row in found["rows"] if row["status"]]
    figure, ((errors, criterion),) = grid(1, 2, 8.5, 1.2 + 0.42 * max(1, len(rows)), sharey=True)
    places = np.arange(len(rows))[::-1]
    for shift, key, label, shade in (
        (0.2, "validation [%]", "not fitted to", colour(0)), (-0.2, "fit [%]", "fitted to", "0.7"),
    ):  # fmt: skip
        values = [row[key] or 0.0 for row in rows]
        errors.barh(places + shift, values, height=0.38, color=shade, label=label)
    errors.set_yticks(
        places,
        labels=[f"{row['law']}\n{row['parameters']} par., {_operations(row)}" for row in rows],
    )
    errors.set_xlabel("rms error over the spread [%]")
    errors.legend(fontsize="small")
    colours = [colour(2) if row["status"] == "SOLVED" else colour(1) for row in rows]
    criterion.barh(places, [row["BIC"] or 0.0 for row in rows], height=0.5, color=colours)
    for place, row in zip(places, rows, strict=True):
        criterion.annotate(
            row["status"],
            (0.0, place),
            (4, 0),
            textcoords="offset points",
            va="center",
            fontsize="small",
        )
    criterion.set_xlabel("BIC over that of the best")
    for axis in (errors, criterion):
        axis.grid(visible=False, axis="y")
    figure.suptitle(f"{found['data']}: {found['how']}", fontsize="medium")
    return save(figure, path)


def _operations(row: Mapping[str, Any]) -> str:
    return "no law" if row["operations"] is None else f"{row['operations']} op."
