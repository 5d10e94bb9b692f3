"""The picture of an identification: friction over velocity, force over time, what is left."""

from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from identification.old.errors import predicted_force, residual_force
from identification.old.result import Identification
from symfric.foundation.panels import panels, save

POINTS = 6000
"""Most samples shown as points."""


def picture(found: Identification, path: str | Path | None = None) -> Figure:
    """Three panels: friction-velocity curve, measured and predicted force, their difference."""
    figure, (curve, force, rest) = panels(3, width=7.5, height=2.6, shared=False)
    rest.sharex(force)
    force.tick_params(labelbottom=False)
    _curve(found, curve)
    signals = found.signals
    predicted = predicted_force(found.drive, signals.v, signals.a)
    times = signals.times
    force.plot(times, signals.equations(signals.force), color="0.6", lw=2.2, label="measured")
    force.plot(times, signals.equations(predicted), color="C3", lw=0.9, label="predicted")
    force.set_ylabel("force [N]")
    force.legend(
        loc="lower right", bbox_to_anchor=(1.0, 1.0), frameon=False, fontsize="small", ncols=2
    )
    rest.plot(times, residual_force(found.drive, signals), color="C0", lw=0.8)
    rest.set_ylabel("difference [N]")
    rest.set_xlabel("t [s]")
    rest.set_title(
        f"inverse-model force error {found.errors.force_relative:.2f} %, "
        f"{found.errors.force_rms:.2g} N rms",
        fontsize="small",
    )
    return save(figure, path)


def _curve(found: Identification, axis: Axes) -> None:
    """Measured friction of every sample and the identified law."""
    signals, drive = found.signals, found.drive
    measured = signals.force - float(drive.m) * signals.a - float(drive.offset)
    thin = slice(None, None, max(1, signals.v.size // POINTS))
    axis.plot(
        signals.v[thin], measured[thin], ".", color="0.6", ms=1.5, alpha=0.5, rasterized=True,
        label="measured: force - m a - offset",
    )  # fmt: skip
    v_max = float(np.abs(signals.v).max())
    side = np.geomspace(1e-5 * v_max, v_max, 400)
    v = np.concatenate([-side[::-1], [0.0], side])
    F = np.asarray(drive.law.force(v, float(drive.N)))
    axis.plot(v, F, color="C3", lw=1.5, label=f"identified: {found.law}")
    low, high = np.percentile(measured, [0.2, 99.8])
    margin = 0.15 * (high - low)
    axis.set_ylim(low - margin, high + margin)
    axis.set_xlabel("v [m/s]")
    axis.set_ylabel("friction [N]")
    axis.legend(loc="upper left", fontsize="small", markerscale=6)
    axis.set_title(f"drive identified from {found.errors.data}")
