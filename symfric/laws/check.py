"""Check of a law: values, sign, passivity, symmetry, load, units, smoothness, states and cost.

The checks evaluate the methods of a law at many velocities, loads and states. They are necessary
conditions at these points, not proofs. Their sentences are in `check.toml`.
"""

import tomllib
from collections.abc import Iterator
from contextlib import suppress
from dataclasses import dataclass, fields
from functools import cached_property
from itertools import pairwise, product
from math import isfinite
from pathlib import Path
from textwrap import wrap
from typing import Any, NamedTuple, final

import casadi as ca
import numpy as np

from symfric.foundation import checks
from symfric.foundation.numeric import Array, is_number, is_symbolic
from symfric.foundation.parameters import parameters, symbolise, with_values
from symfric.foundation.shown import Showing, Shown, TextTable, counted, spaced
from symfric.foundation.units import exponents
from symfric.laws.base import smooth
from symfric.laws.base.law import FORCE, Law, require_law
from symfric.laws.composed.populations import cost
from symfric.laws.static.smooth_peak import BrownMcPhee

TEXTS = tomllib.loads(Path(__file__).with_suffix(".toml").read_text("utf-8"))
LOADS, SPEEDS = (0.5, 1.0, 20.0), np.geomspace(1e-6, 1e3, 181)
"""Normal forces [N], and speeds in multiples of the velocity scale of the law."""
CLOSE, SURPLUS = 1e-6, 1e-3
"""Relative difference of values that count as equal, and energy returned in excess, divided by that
received, of a law that is called not passive."""
BASE_UNITS = {"kg": 1.3, "m": 1.7, "s": 0.6, "K": 1.2, "A": 1.4}
"""Sizes of other units, in SI units, with which the equations must also hold."""
NARROW = 1e-4
"""Factor of the widths with which `outside` is compared."""
MOTIONS = tuple(product((0.1, 1.0, 10.0), (0.3, 3.0, 100.0)))
"""Speeds, in velocity scales, and durations, in relaxation times per radian, of the motions."""
TIGHT = {
    "reltol": 1e-8, "abstol": 1e-10, "max_num_steps": 100000, "disable_internal_warnings": True,
}  # fmt: skip
"""Settings of the integrator of CasADi."""
PHASES = np.linspace(0.0, 20.0, 801)
"""Phases [rad] at which the energy of a motion is compared."""


class Remark(NamedTuple):
    """Result of one check: "ok", "note", "warning" or "error", and a sentence."""

    topic: str
    result: str
    text: str


@final
@dataclass(frozen=True, repr=False)
class LawReport(Showing):
    """Result of `check_law`.

    Attributes:
        law: name of the class of the law.
        remarks: results of the checks, in the order in which they were made.
    """

    law: str
    remarks: tuple[Remark, ...]

    @property
    def passed(self) -> bool:
        """True if there is neither an error nor a warning."""
        return not any(one.result in ("error", "warning") for one in self.remarks)

    def shown(self) -> Shown:
        """Return the description; long sentences continue on further lines."""
        kinds = [one.result for one in self.remarks]
        title = ", ".join(counted(kinds.count(kind), kind) for kind in ("error", "warning"))
        return Shown(
            f"{self.law}: {title}", table=TextTable(("", "", ""), tuple(_lines(self.remarks)))
        )


def _lines(remarks: tuple[Remark, ...]) -> Iterator[Remark]:
    for topic, result, text in remarks:
        first, *more = wrap(text, 76)
        yield Remark(topic, result, first)
        yield from (Remark("", "", line) for line in more)


def check_law(law: Law) -> LawReport:
    """Check the methods of a law numerically, and describe the result in sentences.

    The checks cover number types, sign, passivity, symmetry, load, units, smoothness, steady state,
    the limit `outside` and cost, at speeds of 1e-6 to 1000 velocity scales and loads of 0.5 to
    20 N. A law without a finite `velocity_scale` is checked with 1 m/s. For a rotary law, read
    rad/s and N m.

    Raises:
        ValueError: `law` is not a law, or a parameter is a symbol.
    """
    require_law("check_law", law)
    if symbols := [p.name for p in parameters(law).values() if is_symbolic(p.value)]:
        got = f"symbols for {checks.listed(symbols)}"
        raise ValueError(f"check_law: expected a law with numbers, got {got}; use with_values")
    subject, found = Subject(law), list[Remark]()
    for topic, check in CHECKS.items():
        try:
            for key, values in check(subject):
                result, sentence = TEXTS[topic][key]
                found.append(Remark(topic, result, " ".join(sentence.format(**values).split())))
        except (TypeError, ValueError) as error:  # a method of the law is written wrongly
            found.append(Remark(topic, "error", f"{error}."))
            break
    return LawReport(type(law).__name__, tuple(found))


Results = Iterator[tuple[str, dict[str, Any]]]
"""Keys of sentences with their values."""


@final
class Subject:
    """Law with its force and rate as functions of everything that they depend on."""

    def __init__(self, law: Law) -> None:
        self.law = law
        scale = checks.as_number(law.velocity_scale)
        self.scale = scale if scale is not None and isfinite(scale) else 1.0
        self.speeds = self.scale * SPEEDS
        self.values = np.array([float(p.value) for p in parameters(law).values()])

    @cached_property
    def modes(self) -> bool:
        """True if the law has modes."""
        z = ca.SX.sym("z", len(self.law.states))
        return bool(self.law.switches(ca.SX.sym("v"), ca.SX.sym("N"), z))

    @cached_property
    def function(self) -> ca.Function:
        """Function of v, N, z, inputs, parameters: force, its slope and curvature in v, rate."""
        v, N, z = ca.SX.sym("v"), ca.SX.sym("N"), ca.SX.sym("z", len(self.law.states))
        w, p = ca.SX.sym("w", len(self.law.inputs)), ca.SX.sym("p", self.values.size)
        law, variables = symbolise(self.law, *parameters(self.law))
        inputs = {item.name: w[i] for i, item in enumerate(self.law.inputs)}
        results = ca.vertcat(law.force(v, N, z, **inputs), law.rate(v, N, z, **inputs))
        symbols = [variable.symbol for variable in variables]
        F = ca.substitute(results, ca.vertcat(*symbols), p) if symbols else results
        slope = ca.jacobian(F[0], v)
        outputs = [F[0], slope, ca.jacobian(slope, v), F[1:]]
        return ca.Function("law", [v, N, z, w, p], [ca.densify(y) for y in outputs])

    @cached_property
    def steady_function(self) -> ca.Function:
        """Function of v and N: the states in steady sliding."""
        v, N = ca.SX.sym("v"), ca.SX.sym("N")
        z = ca.vertcat(ca.SX(0, 1), self.law.steady_state(v, N))
        return ca.Function("steady", [v, N], [ca.densify(z)])

    def steady(self, v: Array, N: float) -> Array:
        """Return the states in steady sliding, one column for each velocity."""
        return self.steady_function(v[None], N).full()

    def inputs(self, v: Array) -> Array:
        """Return the further inputs in steady sliding, one column for each velocity."""
        ahead = smooth.sign(v, 0.0) if self.law.facts.odd else np.ones_like(v)
        return np.array([i.steady * ahead for i in self.law.inputs]).reshape(-1, v.size)

    def at(self, v: Array, N: float, z: Array | None = None) -> list[Array]:
        """Return force, slope and curvature at velocities, and rates, one row for each state.

        The states and inputs are those of steady sliding, or `z` and zero.
        """
        w = self.inputs(v) if z is None else np.zeros((len(self.law.inputs), v.size))
        z = self.steady(v, N) if z is None else z
        results: Any = self.function(v[None], N, z, w, np.tile(self.values[:, None], v.size))
        *forces, rates = (one.full() for one in results)
        return [*(one.ravel() for one in forces), rates]


def _values(s: Subject) -> Results:
    v = np.array([-s.scale, s.scale])
    z, w = s.steady(v, 1.0), s.inputs(v)
    named = {item.name: w[i] for i, item in enumerate(s.law.inputs)}
    one = {name: float(value[1]) for name, value in named.items()}
    number = float(s.law.force(s.scale, 1.0, z[:, 1], **one))
    array = np.broadcast_to(np.asarray(s.law.force(v, 1.0, z, **named), float), v.shape)
    x, state = ca.MX.sym("v"), ca.MX.sym("z", z.shape[0])
    matrix = ca.Function("law", [x, state], [s.law.force(x, 1.0, state, **one)])
    forces = [number, array[1], s.at(v, 1.0)[0][1], float(matrix(s.scale, z[:, 1]))]
    if not np.allclose(forces, number, rtol=CLOSE, equal_nan=True):
        yield "differ", {"forces": ", ".join(f"{F:g}" for F in forces)}
    elif (bad := ~np.isfinite(array)).any():
        yield "infinite", {"v": v[bad][0], "F": array[bad][0]}
    else:
        yield "equal", {}


def _sign(s: Subject) -> Results:
    for N, v in product(LOADS, (s.speeds, -s.speeds)):
        F = s.at(v, N)[0]
        if (bad := F * v < 0).any():
            yield "drives", {"F": F[bad][0], "v": v[bad][0], "N": N}
            return
    yield "opposes", {"low": s.speeds[0], "high": s.speeds[-1]}


def _passivity(s: Subject) -> Results:
    kind, returned = "modes" if s.modes else "undecided", 0.0
    if s.law.states and not s.modes:
        with suppress(RuntimeError):  # the integrator of CasADi fails
            returned = max(_returned(s, *motion) for motion in MOTIONS)
            kind = "active" if returned > SURPLUS else "passive"
    if s.law.states or s.modes:
        yield kind, {"count": len(MOTIONS), "returned": returned}
    for sentence in s.law.warnings():
        yield "stated", {"sentence": sentence[:1].upper() + sentence[1:]}


def _returned(s: Subject, speed: float, duration: float) -> float:
    """Return the energy returned in excess along a motion, divided by the energy received.

    The motion starts from rest with the states of rest, at a constant load. States and energy are
    integrated relative to their sizes in steady sliding.
    """
    v, z, t = ca.SX.sym("v"), ca.SX.sym("z", len(s.law.states)), ca.SX.sym("t")
    top, none = np.array([speed * s.scale]), np.zeros(len(s.law.inputs))
    rate = s.function(v, 1.0, z, none, s.values)[3]
    there = s.steady(top, 1.0)
    slopes = ca.Function("slopes", [v, z], [ca.jacobian(rate, z)])(top, there).full()
    fastest = float(np.abs(slopes).max())
    unit = duration / fastest if isfinite(fastest) and fastest > 0 else duration
    motion = top[0] * (ca.sin(t) + 0.6 * ca.sin(2.3 * t + 1.0) - 0.6 * np.sin(1.0) * ca.exp(-t))
    size = np.where(there == 0, 1.0, np.abs(there)).ravel()
    power = float(np.abs(s.at(top, 1.0)[0][0])) * top[0] or 1.0
    F, _, _, rate = s.function(motion, 1.0, size * z, none, s.values)
    ode = ca.vertcat(unit * rate / size, F * motion / power)
    start = np.append(s.steady(np.zeros(1), 1.0).ravel() / size, 0.0)
    dae = {"x": ca.vertcat(z, ca.SX.sym("E")), "t": t, "ode": ode}
    energy = ca.integrator("energy", "cvodes", dae, 0.0, PHASES, TIGHT)(x0=start)["xf"].full()[-1]
    return float(-energy.min() / max(energy.max(), 1e-300))


def _symmetry(s: Subject) -> Results:
    ahead, back = s.at(s.speeds, 1.0)[0], s.at(-s.speeds, 1.0)[0]
    odd = np.allclose(ahead, -back, rtol=CLOSE, atol=0.0)
    parts = [getattr(s.law, item.name) for item in fields(s.law)]  # facts of wrappers are general
    wrong = odd != s.law.facts.odd and not any(isinstance(part, Law | tuple) for part in parts)
    yield "wrong" if wrong else "right", {"kind": "equal" if odd else "different", "value": odd}


def _load(s: Subject) -> Results:
    v = s.scale * np.array([0.1, 1.0, 10.0])
    single, twice = (s.at(v, N)[0] for N in (1.0, 2.0))
    if not np.isfinite(s.at(v, 0.0, s.steady(v, 1.0))[0]).all():
        yield "unloaded", {}
    if np.allclose(twice, single, rtol=CLOSE, atol=0.0):
        yield "independent", {}
    elif np.allclose(twice, 2 * single, rtol=CLOSE, atol=0.0):
        yield "proportional", {}
    else:
        yield "factor", {"low": (twice / single).min(), "high": (twice / single).max()}


def _units(s: Subject) -> Results:
    law, known = s.law, parameters(s.law)
    plain = [f.name for f in fields(law) if not f.metadata and is_number(getattr(law, f.name))]
    if plain:
        yield "plain", {"names": ", ".join(plain)}
    if not known:
        yield "none", {}
        return
    turning = any(p.unit == "rad/s" for p in known.values())
    slip, force = ("rad/s", "N m") if turning else ("m/s", "N")
    more = [item.unit for item in (*law.states, *law.inputs, *known.values())]
    units = [slip, "N", *more]
    if unknown := [unit for unit in units if exponents(unit) is None]:
        yield "unknown", {"names": ", ".join(dict.fromkeys(unknown))}
        return
    sizes = np.array([_size(unit) for unit in units])[:, None]
    v = s.scale * np.array([-3.0, 0.3, 1.0, 20.0])
    p = np.where(s.values == 0.0, 0.3, s.values)[:, None]
    x = np.vstack([v, np.full(v.size, 2.0), 0.7 * s.steady(v, 2.0), s.inputs(v), p + 0 * v])
    cuts = np.cumsum([1, 1, len(law.states), len(law.inputs)])
    here, there = (s.function(*np.split(y, cuts)) for y in (x, sizes * x))
    rates = np.array([_size(state.unit) / BASE_UNITS["s"] for state in law.states])[:, None]
    compared = {"force": (0, _size(force)), "rate": (3, rates)}
    wrong = [
        name
        for name, (i, size) in compared.items()
        if not np.allclose(there[i].full(), size * here[i].full(), rtol=1e-9, atol=0.0)
    ]
    yield "wrong" if wrong else "right", {"names": " and ".join(wrong)}


def _size(unit: str) -> float:
    """Return the size of `unit` in the system of units of the comparison."""
    powers = (exponents(unit) or {}).items()
    return float(np.prod([BASE_UNITS.get(name, 1.0) ** power for name, power in powers]))


def _smoothness(s: Subject) -> Results:
    if s.modes:
        yield "modes", {}
        return
    rest = np.zeros(1)
    z, known = s.steady(rest, 1.0), isfinite(float(s.law.velocity_scale))
    speeds = [float(p.value) for p in parameters(s.law).values() if p.unit in ("m/s", "rad/s")]
    near = 1e-6 * min([s.scale, *(speed for speed in speeds if speed > 0)])
    F, slope, curvature = (float(one[0]) for one in s.at(rest, 1.0, z)[:3])
    most = float(np.abs(s.at(s.speeds, 1.0)[0]).max())
    back, ahead = s.at(np.array([-near, near]), 1.0, np.tile(z, 2))[0]
    change = float(ahead - back)
    apart, rounding = abs(change - 2 * near * slope), 1e-15 * max(abs(ahead), abs(back))
    if not np.isfinite([F, slope, curvature]).all():
        yield "infinite", {"F": F, "slope": slope, "curvature": curvature}
    elif apart > max(1e-3 * most, rounding):
        yield "jump", {"size": abs(change)}
    elif apart > 1e-3 * max(abs(change), 2 * near * most / s.scale) + rounding:
        yield "slope", {"v": 0.0}
    elif not known and not s.law.states and abs(slope) * s.speeds[-1] > 10 * most:
        yield "scale", {"width": most / abs(slope)}
    else:
        yield "smooth", {"slope": slope}
    v = s.speeds
    steps = np.abs(np.diff(s.at(v, 1.0)[0]))
    suspects = [pair for pair, step in zip(pairwise(v), steps, strict=True) if step > 0.02 * most]
    jumps = [place for pair in suspects if (place := _jump(s, *pair)) is not None]
    for place in jumps:
        yield "step", {"v": place}
    z = 0.7 * s.steady(v, 1.0)  # away from kinks in steady sliding
    slopes = s.at(v, 1.0, z)[1]
    wrong = np.full(v.size, not jumps)
    for h in (1e-4, 1e-3):  # rounding errors differ
        ahead, back = (s.at(v * (1 + share), 1.0, z)[0] for share in (h, -h))
        apart = np.abs((ahead - back) / (2 * h * v) - slopes)
        wrong &= apart > 1e-2 * np.abs(slopes) + 1e-4 * most / v
    if wrong.any():
        yield "slope", {"v": v[wrong][0]}


def _jump(s: Subject, low: float, high: float) -> float | None:
    """Return the velocity of a jump of the force between two velocities; None without a jump."""
    first, last = s.at(np.array([low, high]), 1.0)[0]
    size = abs(last - first)
    for _ in range(30):
        middle = (low + high) / 2
        F = s.at(np.array([middle]), 1.0)[0][0]
        if abs(F - first) > abs(last - F):
            high, last = middle, F
        else:
            low, first = middle, F
    return low if abs(last - first) > 0.3 * size else None


def _states(s: Subject) -> Results:
    if not s.law.states:
        return
    v = s.scale * np.array([-1000.0, -300.0, 300.0, 1000.0])
    z, usual = s.steady(v, 1.0), np.abs(s.steady(s.speeds, 1.0)).max(axis=1)
    rate, other = np.abs(s.at(v, 1.0, z)[3]), np.abs(s.at(v, 1.0, 0.9 * z)[3])
    moving = np.any(rate > CLOSE * other, axis=1) & np.any(other > 0, axis=1)
    for state, wrong, size in zip(s.law.states, moving.tolist(), usual, strict=True):
        yield "moving" if wrong and not state.whole else "constant", {"name": state.name}
        if size and not 1e-3 < state.nominal / size < 1e3:
            values = {"nominal": state.nominal, "unit": spaced(state.unit), "size": size}
            yield "nominal", {"name": state.name, **values}


def _limit(s: Subject) -> Results:
    v, known = s.scale * np.array([30.0, 100.0]), parameters(s.law)
    given = {i.name: i.steady for i in s.law.inputs if i.name != FORCE}
    narrow = {n: known[n].value * NARROW**power for n, power in s.law.widths.items()}
    x = ca.SX.sym("v")
    try:
        f = ca.Function("outside", [x], [s.law.sliding(x, 1.0, 1, **given)])
        outside: Array = f(v[None]).full().ravel()
        F = Subject(with_values(s.law, narrow)).at(v, 1.0)[0]
    except ValueError as error:
        if "a sliding force on each side" not in str(error):
            raise
        yield "none", {}
        return
    kind = "equal" if np.allclose(outside, F, rtol=1e-2) else "differs"
    yield kind, {"v": v[0], "outside": outside[0], "F": F[0]}


def _cost(s: Subject) -> Results:
    here, usual = cost(s.law), cost(BrownMcPhee())
    yield "counted", {**vars(here), "usual": usual.value, "slopes": usual.gradient}


CHECKS = {
    "values": _values, "sign": _sign, "passivity": _passivity, "symmetry": _symmetry,
    "load": _load, "units": _units, "smoothness": _smoothness, "states": _states,
    "limit": _limit, "cost": _cost,
}  # fmt: skip
"""Checks by topic."""
