"""Laws of the paper with the numbers of its table 1, under a load of 1 N.

The generic model is `GenericAsperity`, a reconstruction from the text. One number, the speed at
which the life of a contact equals its ageing time, is fitted to the Stribeck curve of table 1. The
period of the counterface gives a lag of the size of C in table 1 (figure 2). Its stiffness is free;
it is chosen so that the paths of figures 4 and 5 reach break-away. `ELEMENTS` are identified from
its hysteresis by `identification.fit_elements`, which figure 5 repeats. The model of Bliman and
Sorine, mentioned only in section 5.1, has no numbers.
"""

from collections.abc import Callable, Mapping, Sequence
from math import ceil

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from symfric import (
    GMS,
    Dahl,
    ElastoPlastic,
    Element,
    GenericAsperity,
    Leuven,
    LuGre,
    MaxwellSlip,
    Slider,
)
from symfric.figures import Scales
from symfric.foundation.numeric import Array
from symfric.foundation.panels import WIDE, grid
from symfric.foundation.style import DASHES, EDGE, QUIET
from symfric.gallery.shared import look
from symfric.laws import AnyLaw, law_name
from symfric.scenes import Prescribed

F_S, F_C, V_S, DELTA = 1.05, 0.2, 98e-6, 0.78  # N, N, m/s, 1
SIGMA_0, SIGMA_1, Z_BA = 0.16e6, 0.08, 0.61e-6  # N/m, N s/m, m
DELTA_L, C = 7.0, 24.0  # 1, N/s
ELEMENTS = ((0.52e6, 0.09), (0.73e6, 0.27), (0.66e6, 0.33), (0.41e6, 0.31))
"""Stiffness [N/m] and share of each element; not in the paper."""
LIFE = 75.7e-6
"""Path in contact over the ageing time of a contact [m/s]; not in the paper."""
PERIOD, DUTY = 1e-5, 0.6
"""Period of the counterface [m] and its fraction in contact; not in the paper."""

PATH = tuple(1e-6 * x for x in (0.0, 1.5, 0.2, 1.1, 0.6, 1.1, 0.2, 1.5, 0.0))
"""Turning points of the path of figure 4 [m]: a loop in a loop, up to 1.5 um; our choice."""
SIGNALS = Scales(static=F_S, kinetic=F_C, elastic=F_C, stretch=1.5e-6, velocity=1e-4)
"""Magnitudes that determine the amplitudes of the figures of `symfric.figures`."""

_SLIDERS = tuple(Slider(k, alpha * F_S) for k, alpha in ELEMENTS)
_TABLE_1 = Prescribed.presets["lampaert_table_1"].friction["law"]
"""Numbers by law; given elements are not scaled, since their level is already F_S."""


def generic(count: int = 2000) -> GenericAsperity:
    """Return the generic model with `count` asperities."""
    ages = DUTY * PERIOD / LIFE
    return GenericAsperity(
        k=2.5e6, mu_0=F_C, mu_inf=F_S, tau_c=ages, lam=PERIOD, duty=DUTY, count=count
    )


def laws(count: int = 2000) -> dict[str, AnyLaw]:
    """Return all laws by their names in the paper; the generic model has `count` asperities."""
    table, elements = _TABLE_1.given, tuple(Element(k, alpha) for k, alpha in ELEMENTS)
    return {
        "generic model": generic(count),
        "GMS": table(GMS(elements=elements, form="event")),
        "Leuven": table(Leuven(elements=_SLIDERS, mu_s=F_S, mu_d=F_C, sigma_1=SIGMA_1, n=200.0)),
        "LuGre": table(LuGre()),
        "elasto-plastic": table(ElastoPlastic()),
        "Maxwell slip": MaxwellSlip(elements=_SLIDERS, form="event"),
        "Dahl": Dahl(sigma_0=SIGMA_0, mu_d=F_C),
    }


Loops = Mapping[str, tuple[Array, Array]]
"""Case -> abscissa and ordinate."""

CASES = (DASHES[0], DASHES[1], DASHES[3])
"""Solid, dashed and dotted lines, as in the paper."""
FIRST = "generic model"


def law_grid(
    laws: Mapping[str, AnyLaw],
    loops: Mapping[str, Loops],
    labels: tuple[str, str],
    behind: Sequence[int] = (0, 1),
) -> Figure:
    """Return a picture with two rows of four panels, a colour per law and a line style per case.

    The panels of a row share their ordinate; the free panel has the key. In the rows `behind`, the
    first case of the generic model is drawn in grey behind the other laws.
    """
    figure, axes = grid(2, 4, WIDE, 4.6, sharex=True, sharey="row")
    panels = [*axes[0], *axes[1]]
    for axis, (name, law) in zip(panels, laws.items(), strict=False):
        row = 0 if axis in axes[0] else 1
        if name != FIRST and row in behind:
            axis.plot(*next(iter(loops[FIRST].values())), color=QUIET, linewidth=1.0)
        for dash, (x, y) in zip(CASES, loops[name].values(), strict=False):
            axis.plot(x, y, color=look(law_name(law))["color"], linestyle=dash, linewidth=1.2)
        axis.set_title(name, fontsize="medium")
        axis.locator_params(axis="x", nbins=4)
        if axis not in axes[0] or axis is axes[0][-1]:  # these panels have none below them
            axis.tick_params(labelbottom=True)
            axis.set_xlabel(labels[0])
    for row in axes:
        row[0].set_ylabel(labels[1])
    key(panels[-1], [*loops[FIRST]])
    return figure


def key(axis: Axes, cases: Sequence[str]) -> None:
    """Draw the legend of the line styles in a separate panel."""
    axis.set_axis_off()
    handles = [
        Line2D([], [], color=EDGE, ls=dash, linewidth=1.2, label=case)
        for dash, case in zip(CASES, cases, strict=False)
    ]
    grey = f"{FIRST}, {cases[0]}"
    handles.append(Line2D([], [], color=QUIET, linewidth=1.0, label=grey))
    axis.legend(handles=handles, loc="center", fontsize="small", frameon=False)


# ---- the equations of the paper in plain NumPy and small steps of constant velocity, without code
# of `symfric`; linear equations are solved exactly over a step

K, ALPHA = np.array(ELEMENTS).T


def stribeck(v: Array) -> Array:
    """Return s(|v|) [N]."""
    return F_C + (F_S - F_C) * np.exp(-np.power(np.abs(v) / V_S, DELTA))


def rigid(v: np.ndarray) -> np.ndarray:
    """Return the mean of mu [N] over the life of rigid contacts under half a sine of load."""
    a = LIFE / v
    return F_S - (F_S - F_C) * np.pi**2 / 2 * (1 + np.exp(-a)) / (a**2 + np.pi**2)


def forces(name: str, t: Array, v: Array) -> Array:
    """Return the force [N] at times `t` [s] of velocities `v` [m/s], starting in steady sliding."""
    begin, step = LAWS[name]
    z, F = begin(float(np.sign(v[0])), float(stribeck(v[:1])[0])), np.full(t.size, np.nan)
    middle = (v[1:] + v[:-1]) / 2
    given = zip(middle.tolist(), np.diff(t).tolist(), stribeck(middle).tolist(), strict=True)
    for i, (speed, h, s) in enumerate(given, start=1):
        z, F[i] = step(z, speed, h, s)
    return F


def difference(name: str, curve: Mapping[str, Array], t: Array, v: Array) -> float:
    """Return the largest difference [N] of a curve from the force at `v` [m/s] and `t` [s]."""
    F = np.interp(curve["t"], t[1:], forces(name, t, v)[1:])
    return float(np.abs(F - curve["F"])[1:].max())


def dahl(z: Array, v: float, h: float, s: float) -> tuple[Array, float]:
    """Return state and force after a step of dF/dx = sigma_0 (1 - F/F_C sgn v)."""
    z = F_C * np.sign(v) + (z - F_C * np.sign(v)) * np.exp(-SIGMA_0 * abs(v) * h / F_C)
    return z, float(z)


def bristle(z: Array, v: float, h: float, s: float, share: float = 1.0) -> tuple[Array, float]:
    """Return state and force after a step of equations 1 and 2."""
    rate = share * SIGMA_0 * abs(v) / s
    z = v / rate + (z - v / rate) * np.exp(-rate * h) if rate > 0 else z + v * h
    return z, float(SIGMA_0 * z + SIGMA_1 * (v - rate * z))


def elasto_plastic(z: Array, v: float, h: float, s: float) -> tuple[Array, float]:
    """Return state and force after a step of section 3.2: alpha is 0 up to z_ba, 1 from z_ss on."""
    r = float(np.clip((z * np.sign(v) - Z_BA) / (s / SIGMA_0 - Z_BA), 0.0, 1.0))
    return bristle(z, v, h, s, (1 + np.sin(np.pi * (r - 0.5))) / 2)


def maxwell(z: Array, v: float, h: float, s: float) -> tuple[Array, float]:
    """Return state and force after a step of equation 10."""
    z = np.clip(z + K * v * h, -ALPHA * F_S, ALPHA * F_S)
    return z, float(z.sum())


def leuven(
    z: Array, v: float, h: float, s: float, alternative: bool = False, delta: float = DELTA_L
) -> tuple[Array, float]:
    """Return state and force after a step of equations 3 and 4, with odd s(v).

    With `alternative`, the state equation is that of section 4. A step in which F_h crosses s is
    divided there.
    """
    parts = max(1, ceil(8 * delta * K.sum() * abs(v) * h / s))
    rate = v
    for _ in range(parts):
        r = z.sum() / s * np.sign(v)
        rest = np.sign(1 - r) * abs(1 - r) ** delta
        rate = v * (rest if alternative else 1 - np.sign(r) * abs(r) ** delta)
        z, _ = maxwell(z, rate, h / parts, s)
    return z, float(z.sum()) + SIGMA_1 * rate


def gms(z: Array, v: float, h: float, s: float) -> tuple[Array, float]:
    """Return state and force after a step of section 4.5; z[1] is the direction of slip or 0."""
    held, mode = z
    mode = np.where(mode * v > 0, mode, 0.0)
    limit = ALPHA * s * np.sign(v)
    slipped = limit + (held - limit) * np.exp(-C * h / s)
    held = np.where(mode != 0, slipped, held + K * v * h)
    over = (mode == 0) & (np.sign(v) * held > ALPHA * s)
    held, mode = np.where(over, limit, held), np.where(over, np.sign(v), mode)
    return np.stack([held, mode]), float(held.sum())


Begin = Callable[[float, float], Array]
Step = Callable[[Array, float, float, float], tuple[Array, float]]
LAWS: dict[str, tuple[Begin, Step]] = {
    "Dahl": (lambda side, s: np.array(F_C * side), dahl),
    "LuGre": (lambda side, s: np.array(s / SIGMA_0 * side), bristle),
    "elasto-plastic": (lambda side, s: np.array(s / SIGMA_0 * side), elasto_plastic),
    "Maxwell slip": (lambda side, s: ALPHA * F_S * side, maxwell),
    "Leuven": (lambda side, s: ALPHA * s * side, leuven),
    "GMS": (lambda side, s: np.stack([ALPHA * s * side, ALPHA * 0 + side]), gms),
}
"""Law -> initial state in the direction `side`, 0 at rest, and step."""


def opening(path: Sequence[float], t_end: float, step: Step, steps: int = 4000) -> float:
    """Return the gap of the inner loop of elements with this step, relative to the force at 7."""
    t, legs = np.linspace(0.0, t_end, steps + 1), np.diff(path)
    phase = (t[1:] + t[:-1]) / 2 / t_end * legs.size
    v = legs[phase.astype(int)] * np.sin(np.pi * (phase % 1)) * np.pi / 2 * legs.size / t_end
    z, F = 0 * ALPHA, [0.0]
    for speed, s in zip(v.tolist(), stribeck(v).tolist(), strict=True):
        z, force = step(z, speed, t_end / steps, s)
        F.append(force)
    at = F[:: steps // legs.size]
    return abs(at[5] - at[3]) / abs(at[7])
