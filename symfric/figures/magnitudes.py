"""Which laws can show what, and the magnitudes from which figures take their excitation."""

from dataclasses import dataclass, fields
from math import inf, isfinite
from typing import final

import casadi as ca
import numpy as np

from symfric.figures.data import Array
from symfric.foundation import checks
from symfric.foundation.parameters import parameters
from symfric.laws import (
    ALL_LAWS,
    PHENOMENA,
    POPULATIONS,
    AnyLaw,
    Law,
    Population,
    law_name,
    steady_force,
)
from symfric.laws.base.law import check_law

GIVEN = ("v", "N", "F_e", "dv")
"""Inputs that a block that is slid or pushed gives a law."""


def parts(law: AnyLaw) -> list[type[AnyLaw]]:
    """The kinds of law inside `law`, from the outside in, each once."""
    found: list[type[AnyLaw]] = [type(law)]
    for item in fields(law):
        value = getattr(law, item.name)
        for child in value if isinstance(value, tuple) else (value,):
            if isinstance(child, Law):
                found += parts(child)
    return list(dict.fromkeys(found))


def phenomena(law: AnyLaw) -> list[str]:
    """The codes of everything that `law` and the laws in it show."""
    shown = {code for part in parts(law) for code in part.facts.phenomena}
    return [code for code in PHENOMENA if code in shown]


def check_any(where: str, law: object) -> None:
    """Refuse what is neither a law nor a population of contacts."""
    if not isinstance(law, Population):
        check_law(where, law)


def finite(where: str, law: AnyLaw, F: Array) -> Array:
    """`F` [N] of a law, if any of it is a number.

    Raises:
        ValueError: none is, as where parameters leave the range of a root or an arcsine.
    """
    if F.size and not np.isfinite(F).any():
        raise ValueError(
            f"{where} of {law_name(law)}: expected parameters under which the force is a number, "
            "got some under which it is none anywhere; the limits of the law say which"
        )
    return F


def require(where: str, law: AnyLaw, *codes: str) -> None:
    """Refuse a law that shows none of `codes`, or needs more than motion and force of a block.

    Raises:
        ValueError: says what is missing, and names laws that have it; what else the law needs.
    """
    check_any(where, law)
    shown = phenomena(law)
    needed = [i.name for i in law.inputs if i.name not in GIVEN] if isinstance(law, Law) else []
    if set(codes) & set(shown) and not needed:
        return
    if set(codes) & set(shown):
        raise ValueError(
            f"{where} of {law_name(law)}: expected a law that needs no more than velocity, load, "
            f"acceleration and applied force, got one that needs {', '.join(needed)}; a figure of "
            "a scene that has them shows it, see `symfric scenes`"
        )
    missing = " or ".join(PHENOMENA[code] for code in codes)
    kinds = (ALL_LAWS | POPULATIONS).items()
    able = [name for name, kind in kinds if set(codes) & set(kind.facts.phenomena)]
    raise ValueError(
        f"{where} of {law_name(law)}: expected a law that shows {missing}, got one that shows "
        f"{', '.join(PHENOMENA[code] for code in shown) or 'nothing by itself'}; "
        f"such laws are {', '.join(able)}"
    )


MASS = 0.8
"""Mass of the block where one is driven [kg], that of `Rabinowicz`."""

NORMAL_FORCE = MASS * 9.81
"""Normal force of the figures if none is given [N]."""


@final
@dataclass(frozen=True)
class Scales:
    """Magnitudes of a law under one normal force.

    Attributes:
        static: peak of the force in steady sliding, or mu_s N where that is more [N].
        kinetic: lowest force beyond the peak, up to 10 velocities [N].
        elastic: force up to which no drift is claimed [N]: sigma_0 z_ba of a law with a break-away
            deflection z_ba, else the kinetic level.
        stretch: static level over the stiffness at rest, the pre-sliding distance [m]; inf for a
            law without pre-sliding.
        velocity: Stribeck velocity [m/s]: the parameter v_s, else where the force has fallen half
            the way from its peak, else the `velocity_scale` of the law, else 100 stretches a
            second.
    """

    static: float
    kinetic: float
    elastic: float
    stretch: float
    velocity: float

    @property
    def mass(self) -> float:
        """Mass of a block to push [kg]: 0.8, or more for a strong contact (1.5 m/s^2 at most)."""
        return max(MASS, self.static / 1.5)


def scales(law: AnyLaw, N: float = NORMAL_FORCE) -> Scales:
    """The magnitudes of `law`, with numbers for parameters, under the normal force `N` [N].

    Raises:
        ValueError: no law, symbols for parameters, N that is not positive.
    """
    check_any("figure", law)
    checks.number("figure: N", N, unit="N", above=0.0)
    known = {p.name: checks.number(f"figure: {p.name}", p.value) for p in parameters(law).values()}
    stiffness = _stiffness(law, N) if "P" in phenomena(law) else 0.0
    velocity = known.get("v_s", float(law.velocity_scale))
    if not isfinite(velocity):
        top = float(steady_force(law, np.array([1e-3]), N)[0])
        velocity = 100 * top / stiffness if stiffness > 0 else 1e-3
    elif "v_s" not in known:
        velocity = _half_fall(law, velocity, N)
    F = steady_force(law, velocity * np.geomspace(1e-3, 10.0, 801), N)
    peak = _peak(F)
    kinetic = float(np.min(F[peak:]))
    static = max(float(F[peak]), known.get("mu_s", 0.0) * N)
    elastic = min(known.get("sigma_0", inf) * known.get("z_ba", inf), kinetic)
    stretch = static / stiffness if stiffness > 0 else inf
    return Scales(static, kinetic, elastic, stretch, velocity)


def _peak(F: Array) -> int:
    """Index at which `F` first falls, or ends."""
    falls = np.flatnonzero((np.diff(F) <= 0) & (F[:-1] > 0))
    return int(falls[0]) if falls.size else F.size - 1


def _half_fall(law: AnyLaw, scale: float, N: float) -> float:
    """The velocity at which the force has fallen half the way [m/s]; `scale` if it does not."""
    v = scale * np.geomspace(1e-2, 1e3, 1001)
    F = steady_force(law, v, N)
    beyond = F[_peak(F) :]
    top, low = beyond[0], np.min(beyond)
    if top - low < 0.01 * top:
        return scale
    half = np.argmax(beyond <= (top + low) / 2)
    return float(v[_peak(F) + half])


def _stiffness(law: AnyLaw, N: float) -> float:
    """dF/dx at rest [N/m]: how the force grows with a displacement of the unloaded contact."""
    if isinstance(law, Population):
        return law.stiffness
    v, z = ca.SX.sym("v"), ca.SX.sym("z", len(law.states))
    slope = ca.jacobian(law.force(v, N, z), z) @ ca.jacobian(law.rate(v, N, z), v)
    return float(ca.Function("stiffness", [v, z], [slope])(0.0, law.steady_state(0.0, N)))
