"""Roles of law parameters: which parameters are fitted, why others are held, natural units.

Natural units of data are a force, a load, a length and a time in which measured numbers are of
order one. Defaults of a law are numbers for one machine. In natural units they suit any machine, so
that the result of a fit does not depend on the units of force, length and time.
"""

from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, fields
from math import isfinite, prod
from re import sub
from typing import NamedTuple, TypeVar, final

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from symfric.foundation.parameters import (
    Parameter,
    Parametric,
    parameters,
    symbolise,
    with_values,
)
from symfric.foundation.units import parsed
from symfric.foundation.variable import POSITIVE
from symfric.laws import Asymmetric, Law
from symfric.laws.composed.populations import steady_force

Array = NDArray[np.float64]

VELOCITIES = ("m/s", "rad/s")
STEEPNESSES = ("s/m", "s/rad")
"""Units of positions and widths on the velocity axis, and of their inverses."""

FITTED = ("mass", "inertia", "offset", "level", "viscous", "velocity scale", "")
"""Roles of parameters that are fitted unless named in `fixed`; "" is an undeclared role."""
BRISTLE = ("stiffness", "damping", "length")
"""Roles of parameters that are fitted if the data show the motion of the internal states."""

REASONS = {
    "width": "smoothing width, small against the speeds",
    "load": "the load is constant in the data",
}
STEADY = "steady sliding does not depend on it"
MACHINE = "of the machine, fitted only on request"

ALIKE = 1e-7
"""Share of a parameter's effect on the force below which the other parameters reproduce it."""
WIDTH, BLEND = 1e-3, 1e-4
"""Smoothing widths of jumps and of narrower blends, relative to the largest speed in the data."""
LARGE = 1e60
"""Viscous coefficient whose force exceeds all others."""
SMALL = 0.1
"""Smoothing width relative to the smallest speed, for points at low speeds."""
SLOWEST, NARROWEST = 2e-3, 1e-5
"""Smallest velocity scale and smoothing width that data resolve, relative to the largest speed."""

LINEAR = ("level", "viscous", "offset", "temperature", "motion")
"""Roles of parameters fitted by value: the force is linear in them, or their sign is unknown."""


def parts(obj: Parametric) -> Iterator[Parametric]:
    """Yield `obj` and every parametric object inside it."""
    yield obj
    for item in fields(obj):
        value = getattr(obj, item.name)
        for child in value if isinstance(value, tuple) else (value,):
            if isinstance(child, Parametric):
                yield from parts(child)


def orders(obj: Parametric) -> Iterator[tuple[str, str, bool]]:
    """Yield the pairs of parameters (low, high, strictly) of `obj` that must stay in order."""
    plain = [n for n, p in parameters(obj).items() if np.ndim(p.value) == 0]
    yield from symbols_in_order(symbolise(obj, *plain)[0])


def symbols_in_order(obj: Parametric) -> Iterator[tuple[str, str, bool]]:
    """Yield the pairs (low, high, strictly) of symbol names, if both values are symbols."""
    for part in parts(obj):
        for pairs, strictly in ((type(part).ordered, False), (type(part).strictly_ordered, True)):
            for pair in pairs:
                low, high = (getattr(part, field) for field in pair)
                if all(isinstance(x, ca.SX) and x.is_symbolic() for x in (low, high)):
                    yield low.name(), high.name(), strictly


def is_coefficient(parameter: Parameter) -> bool:
    """Return True if a parameter is a friction coefficient, which times N is a force level."""
    return parameter.role == "level" and parameter.unit == "1"


def width_of(law: object) -> float:
    """Return the largest known smoothing width of a law [m/s or rad/s], 0 without one."""
    known = parameters(law).values() if isinstance(law, Parametric) else ()
    values = [p.value for p in known if p.role == "width" and p.unit in VELOCITIES]
    return max((float(x) for x in values if isinstance(x, int | float)), default=0.0)


def is_velocity(parameter: Parameter) -> bool:
    """Return True if a parameter is a position or a width on the velocity axis."""
    scale = parameter.role in ("velocity scale", "width", "")
    return scale and parameter.unit in (*VELOCITIES, *STEEPNESSES)


def is_logarithmic(parameter: Parameter) -> bool:
    """Return True if a parameter is fitted by its logarithm.

    Such parameters are positive scales of unknown magnitude, including friction levels with a
    positive lower bound, by which laws divide; other levels may vanish.
    """
    if float(parameter.value) <= 0 or parameter.lower < 0:
        return False
    return parameter.role not in LINEAR or (parameter.role == "level" and parameter.lower > 0)


def is_scale(parameter: Parameter) -> bool:
    """Return True if a parameter is a positive velocity scale or its inverse."""
    return parameter.role == "velocity scale" and parameter.lower >= 0


def velocity(parameter: Parameter, scale: float) -> float:
    """Return a velocity scale, or its inverse, in the unit of the parameter."""
    return scale if parameter.unit in VELOCITIES else 1 / scale


class Speeds(NamedTuple):
    """Largest and smallest speed in the data [m/s or rad/s]; 0 if unknown."""

    largest: float = 0.0
    least: float = 0.0

    @property
    def known(self) -> bool:
        """True if the largest speed is known."""
        return self.largest > 0 and np.isfinite(self.largest)

    def share(self, of_largest: float, of_least: float = 1.0) -> float:
        """Return a share of the largest speed, or of the smallest one if that is less."""
        small = of_largest * self.largest
        return min(small, of_least * self.least) if self.least > 0 else small


def window(parameter: Parameter, speeds: Speeds) -> tuple[float, float]:
    """Return the range of a parameter that data with these speeds resolve, in its unit."""
    low, high = parameter.lower, parameter.upper
    if is_velocity(parameter) and speeds.known:
        slow = speeds.share(NARROWEST if parameter.role == "width" else SLOWEST)
        fast = speeds.largest
        if parameter.unit in STEEPNESSES:
            slow, fast = 1 / fast, 1 / slow
        low, high = max(low, slow), min(high, fast)
    return low, high


def reason(parameter: Parameter, *, directions: bool, bristle: bool | None, machine: bool) -> str:
    """Return the reason why a parameter is not fitted by default; "" if it is fitted.

    Args:
        parameter: parameter of a law or a machine.
        directions: True if the law has two directions, whose levels include the offset.
        bristle: True if the data show the internal states of the law; None if it has no states.
        machine: True if the parameter belongs neither to the law nor to a `Drive`.
    """
    if parameter.name == "N":
        return "given"
    if parameter.role == "offset" and directions:
        return "part of the direction-dependent levels"
    if machine:
        return MACHINE
    if parameter.role in FITTED or (bristle and parameter.role in BRISTLE):
        return ""
    if bristle is False and parameter.role in BRISTLE:
        return STEADY
    return REASONS.get(parameter.role, f"{parameter.role}, fitted only on request")


def viscous_force(law: Law, name: str, speed: float, load: float) -> float:
    """Return the force [N] of a large viscous coefficient relative to it; 0 if it has bounds."""
    known = parameters(law)
    if name not in known or known[name].upper < 2 * LARGE:
        return 0.0
    laws = (with_values(law, {name: x}) for x in (LARGE, 2 * LARGE))
    low, high = (steady_force(one, speed * np.array([-1.0, 1.0]), load) for one in laws)
    return float(np.abs(high - low).max()) / LARGE


def has_directions(obj: Parametric) -> bool:
    """Return True if a law in `obj` distinguishes the two directions."""
    return any(isinstance(part, Asymmetric) for part in parts(obj))


def held_value(parameter: Parameter, speeds: Speeds, size: float) -> float:
    """Return the value of a held parameter; smoothing widths set by the user are unchanged.

    Defaults of other widths are numbers in their natural unit `size`.
    """
    value = float(parameter.value)
    if parameter.role != "width" or value != parameter.default:
        return value
    if parameter.unit not in VELOCITIES:
        return value * size
    if not speeds.known:
        return value
    return speeds.share(BLEND if parameter.field == "v_blend" else WIDTH, SMALL)


def inseparable(
    law: Law, load: float, names: Sequence[str], asked: Collection[str], bristle: bool
) -> dict[str, str]:
    """Return name -> reason for parameters that only another load or temperature can separate.

    The effect of each parameter is compared with combinations of those before it at many speeds and
    at a generic point of the parameters. Effects are sensitivities of the force and of the rates of
    the states if the data show them, otherwise of the force in steady sliding. Parameters in
    `asked` are kept. Parameters that no change separates are left to the fit, which reports them.
    """
    known = parameters(law)
    mine = [n for n in names if n in known]
    around = [n for n, p in known.items() if n not in names and p.role in ("load", "temperature")]
    if law.inputs or not mine:
        return {}
    columns = _effects(law, load, mine, around, bristle)
    constant, changing = columns[0], np.vstack(columns)
    kept, found = list[int](), dict[str, str]()
    for i, name in enumerate(mine):
        others = _same_effect(constant, kept, i)
        if bristle and not np.any(constant[:, i]):
            others = None
        if not bristle and law.states and others == [] and name not in asked:
            found[name] = STEADY
        elif name in asked or others is None or _same_effect(changing, kept, i) is not None:
            kept.append(i)
        else:
            related = ", ".join(mine[k] for k in others)
            found[name] = f"load and temperature are constant: not separable from {related}"
    return found


def _effects(
    law: Law, load: float, mine: Sequence[str], around: Sequence[str], bristle: bool
) -> list[Array]:
    """Return derivatives by the parameters `mine` at many speeds, four arrays (rows, parameters).

    The first array is for the given load and temperature, the others are for different ones.
    """
    law, variables = symbolise(law, *mine, *around)
    v, N = ca.SX.sym("v"), ca.SX.sym("N")
    z = ca.SX.sym("z", len(law.states))
    by_name = {x.name: x for x in variables}
    p = ca.vertcat(*(by_name[n].symbol for n in mine), *(by_name[n].symbol for n in around), N)
    state = z if bristle else ca.SX(law.steady_state(v, N))
    effects = ca.SX(law.force(v, N, state if law.states else ca.SX(0, 1)))
    if bristle and law.states:
        effects = ca.vertcat(effects, ca.SX(law.rate(v, N, z)))
    slope = ca.jacobian(effects, p)[:, : len(mine)]
    usual = [float(by_name[n].start) or 0.1 for n in (*mine, *around)]
    speeds = np.concatenate([side * np.geomspace(1e-7, 1e2, 200) for side in (-1, 1)])
    rng = np.random.default_rng(0)
    nominal = np.array([s.nominal for s in law.states])
    states = nominal[:, None] * rng.uniform(-1, 1, (len(nominal), speeds.size))
    slopes = ca.Function("slope", [v, z, p], [ca.densify(ca.vec(slope))]).map(speeds.size)
    here = np.array([*usual, load or 1.0])
    here *= 1 + 0.1 * rng.random(here.size)
    apart = 0.3 * (np.arange(here.size) >= len(mine))
    places = [here, *(here * (1 + apart * rng.random(here.size)) for _ in range(3))]
    found = list[Array]()
    for at in places:  # scaled columns, one for each parameter
        values = slopes(speeds[None, :], states, at).full().reshape(len(mine), -1, speeds.size)
        size = np.abs(values).max(axis=(0, 2), where=np.isfinite(values), initial=1e-300)
        found.append((values / size[None, :, None]).reshape(len(mine), -1).T)
    return found


def _same_effect(columns: Array, kept: Sequence[int], i: int) -> list[int] | None:
    """Return the columns of `kept` whose combination equals column i; None if there are none."""
    columns = columns[np.isfinite(columns).all(axis=1)]
    column, others = columns[:, i], columns[:, list(kept)]
    others = others / np.maximum(np.linalg.norm(others, axis=0), 1e-300)
    shares = np.linalg.lstsq(others, column, rcond=None)[0]
    if np.linalg.norm(column - others @ shares) > ALIKE * np.linalg.norm(column):
        return None
    least = 1e-3 * np.abs(shares).max(initial=0.0)
    return [k for k, share in zip(kept, shares, strict=True) if abs(share) > least]


P = TypeVar("P", bound=Parametric)

PER_LOAD = ("level", "viscous", "stiffness", "damping")
"""Roles of parameters that multiply the normal force if their unit contains no force."""
SLIDING = (("N m", "N"), ("kg m^2", "kg"), ("rad", "m"), ("Pa", "N m^-2"))
"""Units of rotation and pressure, and the corresponding units of sliding."""


@final
@dataclass(frozen=True)
class Natural:
    """Natural units of force, normal force, length and time, in SI units."""

    force: float = 1.0
    load: float = 1.0
    length: float = 1.0
    time: float = 1.0

    def size(self, parameter: Parameter, known: Mapping[str, Parameter]) -> float:
        """Return the natural unit of a parameter; letters in exponents are names in `known`."""
        text = sub(r"\^([a-z])\b", lambda m: f"^{float(known[m[1]].value):g}", parameter.unit)
        powers = _powers(text)
        if parameter.unit == "rad" and parameter.role == "geometry":  # an angle, not a path
            return 1.0
        if parameter.role == "load" or parameter.field.startswith("N_"):
            return self.load ** powers.get("N", 0.0)
        shared = parameter.role in PER_LOAD and not {"N", "kg"} & powers.keys()
        return self.of_unit(text) * (self.force / self.load if shared else 1.0)

    def of_unit(self, unit: str) -> float:
        """Return the natural unit of a quantity other than a normal force."""
        units = {"N": self.force, "m": self.length, "s": self.time}
        units["kg"] = self.force * self.time**2 / self.length
        return prod(units.get(symbol, 1.0) ** power for symbol, power in _powers(unit).items())

    def viscous(
        self, law: Law, names: Sequence[str], speed: float, load: float
    ) -> dict[str, float]:
        """Return the values of viscous coefficients at which their force is the natural one."""
        known = parameters(law)
        mine = [n for n in names if n in known and known[n].role == "viscous"]
        each = {n: viscous_force(law, n, speed, load) for n in mine}
        return {n: self.force / force for n, force in each.items() if force > 0}

    def sizes(self, whole: Parametric) -> dict[str, float]:
        """Return the natural units of all parameters; 1 if bounds of `whole` are in SI units."""
        known = parameters(whole)
        found = {name: self.size(p, known) for name, p in known.items()}
        bounds = [b for n, p in known.items() if found[n] != 1.0 for b in (p.lower, p.upper)]
        if any(isfinite(b) and not 0.0 <= b <= POSITIVE for b in bounds):
            return dict.fromkeys(found, 1.0)
        return found

    def rescaled(self, whole: P, *, defaults: bool = False) -> P:
        """Return a law or a scene in natural units; with `defaults`, they are unchanged numbers."""
        sizes, known = self.sizes(whole), parameters(whole)
        kept = {n for n, p in known.items() if defaults and p.value == p.default}
        values = {n: float(p.value) / sizes[n] for n, p in known.items() if n not in kept}
        return with_values(whole, values)


def _powers(unit: str) -> dict[str, float]:
    """Return the powers of the symbols in a unit, with those of sliding for rotation."""
    for turning, sliding in SLIDING:
        unit = unit.replace(turning, sliding)
    found = parsed(unit)
    return {} if found is None else dict(found.powers)
