"""Random cases: laws, scenes, parameters, tolerances, methods, inputs and start values.

A case is plain data; a file of a few lines reproduces it on other machines.
"""

import json
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, field
from functools import cache
from pathlib import Path
from random import Random
from typing import Any, TypeVar, final

from symfric.foundation import storable
from symfric.foundation.files import read_json, write_text
from symfric.foundation.parameters import Parameter, options, parameters, with_values
from symfric.laws import ALL_LAWS, Law, Viscous, law_from_text
from symfric.scenes import ALL_SCENES, MECHANISMS, Scene
from symfric.stress.referee import Signal, knows
from symfric.stress.referee_equations import LAWS
from symfric.stress.referee_equations import SCENES as REFEREED_SCENES

T = TypeVar("T")

SCENES = ("rabinowicz",) * 6 + ("drive",) * 6 + ("quarter_car",) * 2 + tuple(MECHANISMS)
"""Scenes, repeated by their weight; those with one contact find the most errors for their cost."""

REFEREED = 0.5
"""Fraction of the cases with laws and scenes of the independent reference solver."""

OFFERED: dict[str, set[str]] = {
    "quarter_car": {"F_e", "x_rel", "v_rel"},
    **{scene: {"F_e"} for scene in ("rabinowicz", "drive", *MECHANISMS)},
}
"""Scene -> inputs of laws, in addition to v and N, that the scene provides."""

WRAPPED = ("{}+viscous", "asymmetric({})", "lagged({})", "load_dependent({})",
           "temperature_dependent({})")  # fmt: skip
METHODS = ("auto",) * 3 + ("rodas5p", "radau5") * 2 + ("rodas4p", "radau9", "rodas3", "dopri5")
ADAPTED = METHODS[:-1]
"""Methods for mechanisms; dopri5 does not support their algebraic unknowns."""
LOOPS = ("four_mass", "slider_crank", "four_bar")
"""Scenes whose start values must be consistent, so that few start values are drawn."""
SPREADS = (0.3, 1.0, 2.5)
"""Largest deviations of the parameters of a case from their defaults [decades]."""


@final
@dataclass(frozen=True)
class Case:
    """Data of one simulation.

    Attributes:
        seed, number: seed of the campaign, and number of the case.
        law, scene: names, as on the command line.
        values: parameters of scene and law that differ from their defaults.
        forms: options of the law.
        free: names in `values` whose values are given at run time, `simulate(p=...)`.
        x0: start values of states.
        inputs: input -> signal.
        t_start, t_end: start and end time [s].
        rtol, method, backend: as in `simulate`.
    """

    seed: int
    number: int
    scene: str
    law: str
    values: Mapping[str, float] = field(default_factory=dict[str, float])
    forms: Mapping[str, str] = field(default_factory=dict[str, str])
    free: tuple[str, ...] = ()
    x0: Mapping[str, float] = field(default_factory=dict[str, float])
    inputs: Mapping[str, Signal] = field(default_factory=dict[str, Signal])
    t_start: float = 0.0
    t_end: float = 1.0
    rtol: float = 1e-6
    method: str = "auto"
    backend: str = "vm"

    def to_dict(self) -> dict[str, Any]:
        """Return plain data for JSON."""
        return asdict(self)

    def write(self, path: str | Path) -> None:
        """Write the file that `symfric stress --case` reads."""
        write_text(path, json.dumps(self.to_dict(), indent=1) + "\n")

    @classmethod
    def read(cls, path: str | Path) -> "Case":
        """Return the case in a file that contains a case, or a case and its verdict.

        Raises:
            ValueError: the file does not exist, or its content is not a case.
        """
        data = read_json("case", path, "JSON of a case")
        try:
            content = dict(data.get("case", data))
            content["free"] = tuple(content.get("free", ()))
            content["inputs"] = {
                name: Signal(s["kind"], tuple(map(float, s["values"])), tuple(map(float, s["t"])))
                for name, s in content.get("inputs", {}).items()
            }
            return cls(**storable.checked(cls, content))
        except (TypeError, KeyError, AttributeError, ValueError) as error:
            what = "expected what `symfric stress` wrote, got others"
            raise ValueError(f"case '{path}': {what}: {error}") from None


@final
class Draws:
    """Random numbers of one case, equal on every machine and in every version of Python.

    All numbers are computed from `Random.random`, whose sequence Python guarantees.
    """

    def __init__(self, seed: int, number: int) -> None:
        self._random = Random(f"{seed}/{number}")

    def unit(self) -> float:
        """Return a number in [0, 1)."""
        return self._random.random()

    def chance(self, probability: float) -> bool:
        """Return True with this probability."""
        return self.unit() < probability

    def pick(self, items: Sequence[T]) -> T:
        """Return one of `items`; repeated items are drawn more often."""
        return items[int(self.unit() * len(items))]

    def between(self, low: float, high: float) -> float:
        """Return a number in [low, high), rounded to three digits."""
        return rounded(low + (high - low) * self.unit())

    def decade(self, low: float, high: float) -> float:
        """Return 10^e with e in [low, high), rounded to three digits."""
        return rounded(10.0 ** (low + (high - low) * self.unit()))

    def signed(self, low: float, high: float) -> float:
        """Return `decade(low, high)` with a random sign."""
        return self.decade(low, high) * self.pick((1.0, -1.0))


def rounded(value: float) -> float:
    """Return a value rounded to three significant digits, so that last bits of powers cancel."""
    return float(f"{value:.3g}")


def draw(seed: int, number: int) -> Case:
    """Return case `number` of the campaign `seed`; each case has a separate random sequence."""
    rng = Draws(seed, number)
    refereed = rng.chance(REFEREED)
    scene = rng.pick(tuple(REFEREED_SCENES) if refereed else SCENES)
    known = [name for name in LAWS if knows(name, scene)]
    text = rng.pick(known) if refereed else _law(rng, scene)
    law = law_from_text(text)
    machine = ALL_SCENES[scene](law)
    forms = {name: rng.pick(form.choices) for name, form in options(law).items() if rng.chance(0.3)}
    values = _values(rng, machine)
    span = rounded(machine.t_end * rng.decade(-1.3, 0.2))
    t_start = rng.decade(0, 5) if rng.chance(0.03) else 0.0
    rtol = rng.pick((1e-3, 1e-4, 1e-5, 1e-7, 1e-8, 1e-9)) if rng.chance(0.6) else 1e-6
    inputs = {
        name: _signal(rng, span, t_start)
        for name in _inputs(scene)
        if scene == "drive" or rng.chance(0.3)
    }
    return Case(
        seed=seed,
        number=number,
        scene=scene,
        law=text,
        values=values,
        forms=forms,
        free=tuple(name for name in values if rng.chance(0.5)) if rng.chance(0.15) else (),
        x0=_starts(rng, scene, law, values),
        inputs=inputs,
        t_start=t_start,
        t_end=t_start + span,
        rtol=rtol,
        method=rng.pick(ADAPTED if scene in MECHANISMS and not rng.chance(0.1) else METHODS),
        backend="compiled" if scene in ("rabinowicz", "drive") and rng.chance(0.01) else "vm",
    )


def _law(rng: Draws, scene: str) -> str:
    """Draw a law, one in six in a wrapper or a sum; few need inputs that are not available."""
    name = rng.pick(list(ALL_LAWS))
    while not {i.name for i in ALL_LAWS[name]().inputs} <= OFFERED.get(scene, set()):
        if rng.chance(0.1):
            break
        name = rng.pick(list(ALL_LAWS))
    text = rng.pick(WRAPPED).format(name) if rng.chance(1 / 6) else name
    try:
        law_from_text(text)
    except ValueError:  # some wrappers accept only laws without states
        return name
    return text


def _values(rng: Draws, machine: Scene) -> dict[str, float]:
    """Draw numbers of law and scene; few of them are invalid, such as mu_d > mu_s."""
    while True:
        found = _numbers(rng, parameters(machine))
        try:
            with_values(machine, found)
        except ValueError:
            if not rng.chance(0.1):
                continue
        return found


def _numbers(rng: Draws, known: Mapping[str, Parameter]) -> dict[str, float]:
    """Draw values for one parameter in three, decades from the default, zero or of other sign."""
    spread = rng.pick(SPREADS)
    found: dict[str, float] = {}
    for name, parameter in known.items():
        if not rng.chance(1 / 3):
            continue
        value = float(parameter.default) * rng.decade(-spread, spread)
        if parameter.lower < 0:
            value *= rng.pick((1.0, 1.0, 1.0, -1.0))
        if rng.chance(0.04) or value == 0.0:
            value = 0.0
        found[name] = rounded(min(max(value, parameter.lower), parameter.upper))
    return found


def _starts(rng: Draws, scene: str, law: Law, values: Mapping[str, float]) -> dict[str, float]:
    """Draw start values of some states: rest, almost rest, fast, or the velocity of the belt."""
    found: dict[str, float] = {}
    share = 0.05 if scene in LOOPS else 0.4
    for name, unit, start in _states(scene):
        if not rng.chance(share):
            continue
        if unit.endswith("/s"):
            value = rng.pick((0.0, rng.signed(-9, 1), rng.signed(-2, 0.5)))
            on_belt = scene == "rabinowicz" and rng.chance(0.5)
            found[name] = value + (values.get("v_belt", 0.1) if on_belt else 0.0)
        else:
            found[name] = start + rng.signed(-6, 0)
    if scene not in MECHANISMS and rng.chance(0.1):
        found |= {state.name: state.nominal * rng.signed(-2, 0.5) for state in law.states}
    return found


def _signal(rng: Draws, span: float, t_start: float) -> Signal:
    """Draw an input: constant, samples, a sine or a short pulse, with a size over decades."""
    kind = rng.pick(("constant", "hold", "linear", "sine", "sine", "pulse"))
    size = rng.signed(-1.5, 1.5)
    if kind == "constant":
        return Signal(kind, (size,))
    if kind == "sine":
        return Signal(kind, (size, rng.decade(-1, 2), rng.pick((0.0, 0.5 * size))))
    if kind == "pulse":
        width = span * rng.decade(-3, -0.5)
        return Signal(kind, (size, t_start + rounded(span * rng.unit()), width))
    count = int(rng.between(2, 20))
    times = tuple(t_start + span * k / count for k in range(count))
    return Signal(kind, tuple(size * rng.between(-1, 1) for _ in times), times)


@cache
def _states(scene: str) -> tuple[tuple[str, str, float], ...]:
    """Return name, unit and start value of the states of a scene, without those of its law."""
    states = ALL_SCENES[scene](Viscous()).model().x
    return tuple((v.name, v.unit, float(v.start)) for v in states)


@cache
def _inputs(scene: str) -> tuple[str, ...]:
    return tuple(v.name for v in ALL_SCENES[scene](Viscous()).model().u)
