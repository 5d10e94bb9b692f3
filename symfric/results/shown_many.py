"""How ensembles show themselves: members, failures, and where signals end."""

from typing import TYPE_CHECKING

import numpy as np
from matplotlib.figure import Figure

from symfric.foundation.shown import Shown, Table, among, counted, valued
from symfric.foundation.style import COLOURS

if TYPE_CHECKING:
    from symfric.results.ensemble import Ensemble

MOST = 5_000_000
"""Numbers that are read without being asked for; of a file every page, for its last column."""
LINES = 200
"""Members in a picture."""


def shown(runs: "Ensemble") -> Shown:
    """How many members, how they ended, and least, middle and greatest value at the last time."""
    members, times = runs.attempts.size, runs.t.shape[-1]
    first, last = np.min(runs.t), np.max(runs.t)
    span = f"{counted(times, 'time')} from {first:g} to {last:g} s" if times > 1 else f"{last:g} s"
    done = int(np.isfinite(runs.reached).sum())
    left = f", {members - done} members not started" if done < members else ""
    lines = [f"{runs.status.name}: {counted(runs.attempts.sum(), 'attempt')} in all{left}"]
    if runs.varied:
        lines.append("varied: " + ", ".join(_range(runs, name) for name in runs.varied))
    if runs.fixed:
        known = ((n, v, runs.unit(n)) for n, v in runs.fixed.items())
        lines.append(f"fixed: {valued(known)}")
    for number, why in list(runs.failed.items())[:3]:
        lines.append(f"member {number} failed: {why}")
    if runs.doubtful:
        first, why = next(iter(runs.doubtful.items()))
        lines.append(f"doubtful: {len(runs.doubtful)}, the first is {first}: {why}")
    if len(runs.failed) > 3:
        lines.append(f"failed: {len(runs.failed)}, members {among(map(str, runs.failed))}")
    rows = list[tuple[str, ...]]()
    mapped = any(isinstance(values, np.memmap) for values in runs.signals.values())
    read = (members * times if mapped else members) <= MOST
    for name in runs.signals:
        rows.append((name, runs.units[name], *(_ends(runs, name) if read else ("", "", ""))))
    header = ("signal", "unit", "least", "median", "greatest")
    return Shown(
        f"ensemble of '{runs.scene}': {counted(members, 'member')} at {span}",
        tuple(lines),
        Table(header, tuple(rows), numbers=(2, 3, 4)),
        ("over the members, at the last time",) if read else (),
    )


def _range(runs: "Ensemble", name: str) -> str:
    values, unit = runs.varied[name], runs.unit(name)
    said = "" if unit in ("", "1") else f" {unit}"
    return f"{name} from {values.min():.6g} to {values.max():.6g}{said}"


def _ends(runs: "Ensemble", name: str) -> tuple[str, str, str]:
    values = np.asarray(runs.signals[name][:, -1])
    values = values[np.isfinite(values)]
    if not values.size:
        return "", "", ""
    low, middle, high = (f"{x:.6g}" for x in (values.min(), np.median(values), values.max()))
    return low, middle, high


def picture(runs: "Ensemble") -> Figure | None:
    """The first signal of the first members over time; nothing where there are only ends."""
    if runs.t.ndim > 1 or runs.t.size < 2:
        return None
    name, values = next(iter(runs.signals.items()))
    figure = Figure(figsize=(5.2, 1.9), layout="constrained")
    axis = figure.subplots()
    axis.plot(runs.t, np.asarray(values[:LINES]).T, linewidth=0.6, color=COLOURS[0], alpha=0.4)
    axis.set_xlabel("t [s]", fontsize=7)
    axis.set_ylabel(f"{name} [{runs.units[name]}]", fontsize=7)
    axis.tick_params(labelsize=7)
    axis.grid(alpha=0.3)
    return figure
