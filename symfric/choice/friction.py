"""Friction that all candidates describe, and the parameters with which each law describes it."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from math import asin, exp, pi
from typing import final

import numpy as np
from scipy.optimize import brentq

from symfric import laws
from symfric.foundation import checks
from symfric.foundation.numeric import Array
from symfric.foundation.parameters import parameters, with_values
from symfric.laws import Law, steady_force


@final
@dataclass(frozen=True)
class Friction:
    """Dry friction that all laws must describe.

        F = mu_d N sign(v) in sliding,  |F| <= mu_s N at rest         v_s = None
        F = N [mu_d + (mu_s - mu_d) exp(-(v/v_s)^2)] sign(v)          with v_s

    Attributes:
        mu_s, mu_d: static and dynamic friction coefficient.
        v_s: Stribeck velocity [m/s], over which friction falls after break-away; None if it falls
            immediately or was not measured. Without it the Stribeck velocities of laws are scaled
            like their widths, and only the limit is compared.
    """

    mu_s: float = 0.15
    mu_d: float = 0.1
    v_s: float | None = None

    def __post_init__(self) -> None:
        checks.number("friction: mu_d", self.mu_d, above=0.0)
        checks.number("friction: mu_s", self.mu_s, lower=self.mu_d, hint="mu_s >= mu_d")
        if self.v_s is not None:
            checks.number("friction: v_s", self.v_s, unit="m/s", above=0.0)

    @property
    def exact(self) -> laws.ExactCoulomb:
        """Law of this friction without regularisation."""
        if self.v_s is None:
            return laws.ExactCoulomb(mu_s=self.mu_s, mu_d=self.mu_d)
        return laws.ExactCoulomb(mu_s=self.mu_s, mu_d=self.mu_d, v_s=self.v_s, form="stribeck")

    def sliding(self, speed: float) -> float:
        """Return the friction coefficient in steady sliding at a speed > 0 [m/s]."""
        fall = 0.0 if self.v_s is None else exp(-((speed / self.v_s) ** 2))
        return self.mu_d + (self.mu_s - self.mu_d) * fall

    def __str__(self) -> str:
        """Return the coefficients and the Stribeck velocity as text."""
        falls = "falling at once" if self.v_s is None else f"v_s = {self.v_s:g} m/s"
        return f"mu_s = {self.mu_s:g}, mu_d = {self.mu_d:g}, {falls}"


def friction_of(law: Law) -> Friction:
    """Return the friction with mu_s and mu_d of `law`.

    If the law has only one of them, the other follows from the default ratio.
    """
    known, default = parameters(law), Friction()
    levels = {n: float(known[n].value) for n in ("mu_s", "mu_d") if n in known}
    mu_d = levels.get("mu_d", default.mu_d * levels.get("mu_s", default.mu_s) / default.mu_s)
    return Friction(levels.get("mu_s", default.mu_s * mu_d / default.mu_d), mu_d)


FALL: dict[type[Law], str] = {
    laws.BengisuAkay: "xi",
    laws.Exudyn: "v_exp",
    laws.Benson: "d_c",
    laws.DuanSingh: "c",
    laws.PoppStelter: "d",
    laws.MakkarDixon: "gamma_3",
}
"""Names of the Stribeck velocity, or of its inverse, by law, if it is not v_s."""
NO_FALL = (laws.VelocityBased, laws.StickSlip)
"""Laws in which v_s is the width of the transition and not a Stribeck velocity."""


def fall_of(law: Law) -> str | None:
    """Return the name of the Stribeck velocity of `law` or of its inverse; None if it has none."""
    if isinstance(law, NO_FALL):
        return None
    name = FALL.get(type(law), "v_s")
    return name if name in parameters(law) else None


Levels = Callable[[Friction, float], Mapping[str, float]]


def _of_bliman(f: Friction, _: float) -> Mapping[str, float]:
    """Return mu_1 and mu_2 such that mu_1 - mu_2 is mu_d and the peak is mu_s."""
    if f.mu_s <= f.mu_d:
        return {"mu_1": f.mu_d, "mu_2": 0.0}

    def missing(mu_2: float) -> float:
        return float(laws.BlimanSorine(f.mu_d + mu_2, mu_2).static_level(1.0)) - f.mu_s  # pyright: ignore[reportArgumentType]

    mu_2 = float(brentq(missing, 1e-6 * f.mu_d, 1e6 * f.mu_d))  # pyright: ignore[reportArgumentType]
    return {"mu_1": f.mu_d + mu_2, "mu_2": mu_2}


def _shared(law: type[laws.MaxwellSlip | laws.Leuven], total: str) -> Levels:
    """Return the levels of the default elements, scaled such that together they carry `total`."""
    mu = {n: p.value for n, p in parameters(law()).items() if n[:3] == "mu_" and n[3:].isdigit()}
    least = getattr(law(), "mu_s", sum(mu.values()))  # elements of Leuven carry more than mu_s
    return lambda f, _: {n: value * getattr(f, total) / least for n, value in mu.items()}


LEVELS: dict[type[Law], Levels] = {
    laws.Bittencourt: lambda f, _: {
        "F_cl": f.mu_d,
        "F_sl": f.mu_s - f.mu_d,
        **dict.fromkeys(("F_c0", "F_s0", "F_sT", "F_v0", "F_vT"), 0.0),
    },
    laws.QuarterCarSimple: lambda f, N: {"C_e": f.mu_s * N, "sigma_v": 0.0},
    laws.PoppStelter: lambda f, _: {"eta": f.mu_d / f.mu_s},
    laws.Armstrong: lambda f, _: {"mu_inf": f.mu_s - f.mu_d, "mu_a": 0.2 * (f.mu_s - f.mu_d)},
    laws.BlimanSorine: _of_bliman,
    laws.MaxwellSlip: _shared(laws.MaxwellSlip, "mu_d"),
    laws.Leuven: _shared(laws.Leuven, "mu_s"),
    laws.SteadyStateLuGre: lambda f, N: {"F_S": f.mu_s * N, "F_C": f.mu_d * N, "sigma_2": 0.0},
    laws.RuiWang: lambda f, N: {"D": f.mu_s * N, "C": 2 - 2 / pi * asin(f.mu_d / f.mu_s)},
    laws.Spline: lambda f, _: {n: f.mu_d for n in parameters(laws.Spline()) if n[:2] == "c_"},
    laws.Network: lambda f, _: (
        {n: 0.0 for n in parameters(laws.Network()) if n[:2] == "w_"} | {"b": f.mu_d}
    ),
    laws.MixedLubrication: lambda f, _: {"mu_b": f.mu_d, "eta": 0.0},
    laws.MakkarDixon: lambda f, N: {"gamma_1": (f.mu_s - f.mu_d) * N, "gamma_4": f.mu_d * N},
}
"""Functions (friction, load) -> levels by law, for laws whose levels are not mu_s and mu_d."""


def alike(law: Law, friction: Friction, load: float | None) -> Law:
    """Return `law` with the levels of `friction` and, if known, its Stribeck velocity.

    Args:
        law: the law.
        friction: the friction that the law must describe.
        load: normal force [N]; None if it is not one number.

    Raises:
        ValueError: the levels of the law are forces, and the load is not one number.
    """
    known = parameters(law)
    values = {name: getattr(friction, name) for name in ("mu_s", "mu_d") if name in known}
    if levels := LEVELS.get(type(law)):
        values |= levels(friction, 1.0 if load is None else load)
    in_newton = [
        n for n, p in known.items()
        if p.role == "level" and p.unit in ("N", "N m") and values.get(n) != 0.0
    ]  # fmt: skip
    if in_newton and load is None:
        raise ValueError(
            f"its levels ({', '.join(in_newton)}) are forces, and the load here is not one number"
        )
    fall = fall_of(law)
    if friction.v_s is not None and fall is not None:
        inverse = known[fall].unit in ("s/m", "s/rad")
        values[fall] = 1 / friction.v_s if inverse else friction.v_s
    return with_values(law, values)


def peaked(law: Law, mu_s: float, load: float | None) -> Law:
    """Return a static law whose largest force in steady sliding is mu_s N.

    The product of a smooth sign and a Stribeck weight is at most 0.05 % to 7 % below the static
    level of the formula, whereas measurements give the peak. All other laws remain unchanged.
    """
    known = parameters(law)
    apart = {"mu_s", "F_S", "gamma_1", "F_sl"} & set(known)
    if law.states or law.inputs or "S" not in law.facts.phenomena or not apart:
        return law
    N = 1.0 if load is None else load
    if "mu_d" in known and known["mu_s"].value == known["mu_d"].value:
        return law
    widths = [p for p in known.values() if p.role in ("velocity scale", "width")]
    speeds = [float(p.value) for p in widths if p.unit in ("m/s", "rad/s") and p.value > 0]
    speeds += [1 / float(p.value) for p in widths if p.unit in ("s/m", "s/rad")]
    wide = np.geomspace(0.02 * min(speeds), 20 * max(speeds), 2001)
    for _ in range(PASSES):
        top = _top(law, wide, N)
        if abs(top - mu_s) <= 1e-9 * mu_s:
            break
        law = with_values(law, _raised(law, mu_s / top, mu_s - top, N, wide))
    return law


PASSES = 12
"""Largest number of corrections of a peak; each reduces the error to a few per cent."""


def _top(law: Law, v: Array, N: float) -> float:
    """Return the largest ratio F/N in steady sliding, from the grid `v` and a finer one near it."""
    F = steady_force(law, v, N)
    k = int(np.argmax(F))
    near = np.geomspace(v[max(k - 1, 0)], v[min(k + 1, v.size - 1)], 201)
    return float(max(F[k], steady_force(law, near, N).max())) / N


def _raised(law: Law, factor: float, missing: float, N: float, v: Array) -> dict[str, float]:
    """Return parameters that raise the peak by a `factor`, or by the coefficient `missing`."""
    now = {name: float(p.value) for name, p in parameters(law).items()}
    if isinstance(law, laws.MakkarDixon):  # the excess of the peak is a share of gamma_1
        share = float((np.tanh(now["gamma_2"] * v) - np.tanh(now["gamma_3"] * v)).max())
        return {"gamma_1": now["gamma_1"] + missing * N / share}
    if isinstance(law, laws.Bittencourt):
        return {"F_sl": now["F_sl"] + missing}
    if isinstance(law, laws.PoppStelter):
        return {"mu_s": now["mu_s"] * factor, "eta": now["eta"] / factor}
    name = "F_S" if isinstance(law, laws.SteadyStateLuGre) else "mu_s"
    return {name: now[name] * factor}
