"""Parameters that make a law smooth, and its distance from dry friction.

A smooth law has a width, such as v_t, below which it creeps instead of resting; bristles have a
stiffness. As all widths of a law shrink with a factor s (stiffnesses grow with 1/s) its motion
tends to that with dry, set-valued friction,

    |x(s) - x(0)| = C s^q

The order q is a matter of what the motion does, not of the law alone:

    1      a contact that comes to rest and stays there: it creeps at a velocity of order v_t; with
           tanh times a logarithm
    2/3    break-away over a falling branch that is itself of width v_t (Brown-McPhee): the state
           lingers at the peak, the fold of the stick branch
    1/2    bristles that are turned: time to slide their deflection F/sigma_0 from rest
    > 1    a contact that only slides, 3 with Brown-McPhee, whose tail falls like (v_t/v)^3

Where contacts rest as one their loads are not determined by dry friction: with mu_s > mu_d each
smooth law tends to an instant of break-away of its own.

Far from the limit there is no order at all: where rest is longer than motion, creep is everything.
"""

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from math import inf, isfinite
from time import process_time
from typing import final

import numpy as np
from numpy.typing import NDArray

from symfric.foundation import checks
from symfric.foundation.numeric import is_number
from symfric.foundation.parameters import Parameter, parameters, with_values
from symfric.foundation.status import Status
from symfric.integrator.equations.inputs import Input
from symfric.integrator.simulate import simulate
from symfric.laws import Law
from symfric.laws.base.families import Sticking
from symfric.laws.base.law import check_law
from symfric.model import Model
from symfric.model.kinds import FRICTION_STATE, MODE, POSITION
from symfric.results.trajectory import Trajectory
from symfric.scenes import Scene

Array = NDArray[np.float64]
Measure = Sequence[str] | Callable[[Trajectory], Array]
"""Signals by name, or a function that takes numbers from a trajectory, such as periods."""
SAMPLES = 2001
"""Times at which motions are compared."""
NEGLIGIBLE = 1e-9
"""Widths below this [m/s] only round off a modulus; they are not what makes a law smooth."""
DIGITS = 12
"""Of scaled parameters: what is behind is rounding."""
STILL = 1e-9
"""Signal that moves by less than this times its nominal size is measured by the latter."""


@dataclass(frozen=True, eq=False)
class Regularisation:
    """Parameters that make `law` smooth, scaled together by a factor s; dry friction at s = 0.

    Attributes:
        powers: parameter -> power of s: widths, velocities and paths are scaled by s, stiffnesses
            and inverse velocities by 1/s, the damping of bristles by 1/sqrt(s), the same part of
            critical.
    """

    law: Law
    powers: Mapping[str, float]

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the parameters."""
        return tuple(self.powers)

    def values(self, s: float) -> dict[str, float]:
        """Their values at the factor `s`."""
        known = parameters(self.law)
        scaled = {n: float(known[n].value) * s**power for n, power in self.powers.items()}
        return {n: float(f"{value:.{DIGITS}g}") for n, value in scaled.items()}

    def at(self, s: float) -> Law:
        """Return the law at the factor `s`."""
        return with_values(self.law, self.values(s))

    def factor(self, value: float) -> float:
        """Return the factor at which the first of the parameters has this value."""
        first = parameters(self.law)[self.names[0]]
        now = float(first.value)
        return (value / now) ** (1 / self.powers[first.name])


def regularisation(
    where: str, law: Law, parameter: str | Iterable[str] | None = None
) -> Regularisation:
    """Return the parameters that make `law` smooth: `parameter`, or those of certain roles.

    Those are the stiffnesses of bristles, their damping and the paths they remember, transition
    velocities called v_t and smoothing widths [m/s]; of a law without these its only velocity.

    Raises:
        ValueError: no law, no such parameter, or several velocities that may be meant.
    """
    check_law(f"{where}: law", law)
    known = parameters(law)
    if parameter is not None:
        given = [parameter] if isinstance(parameter, str) else parameter
        return _numbers(where, law, checks.names(f"{where}: parameter", given, known))
    if isinstance(law, Sticking) and law.has_mode:
        raise ValueError(
            f"{where}: law: expected a law that has to be made smooth, got {type(law).__name__}, "
            "which rests exactly"
        )
    scales = [n for n, p in known.items() if p.role == "velocity scale"]
    widths = [n for n, p in known.items() if p.role == "width" and p.unit in ("m/s", "rad/s")]
    widths = [n for n in widths if float(known[n].value) > NEGLIGIBLE]
    stiff = [n for n, p in known.items() if p.role == "stiffness"] if law.states else []
    stiff += [n for n, p in known.items() if stiff and p.role == "damping" and p.value != 0.0]
    paths = [n for n, p in known.items() if p.role == "length"] if law.states else []
    named = [n for n in scales if known[n].field == "v_t"]
    found = [*stiff, *paths, *named, *widths] or scales
    if not found:
        raise ValueError(
            f"{where}: law: expected a law with a width or a stiffness, got {type(law).__name__}, "
            "which has none; is it dry already, or smooth by nature?"
        )
    if found is scales and len(scales) > 1:
        raise ValueError(
            f"{where}: parameter: expected what makes {type(law).__name__} smooth, one of "
            f"{', '.join(scales)}, got none"
        )
    return _numbers(where, law, tuple(found))


def _numbers(where: str, law: Law, names: tuple[str, ...]) -> Regularisation:
    """Return `names`, whose values have to be positive numbers."""
    known = parameters(law)
    for name in names:
        value = known[name].value
        if not is_number(value) or not float(value) > 0.0:
            raise checks.refused(f"{where}: law: {name}", "a number > 0 to start from", value)
    if not names:
        raise ValueError(f"{where}: parameter: expected the names of one or more, got none")
    return Regularisation(law, {name: _power(known[name]) for name in names})


def _power(p: Parameter) -> float:
    """Power of s with which the parameter is scaled."""
    if p.role == "damping":
        return -0.5
    return -1.0 if p.role == "stiffness" or p.unit in ("s/m", "s/rad", "1/m") else 1.0


@final
@dataclass(frozen=True, eq=False)
class Machine:
    """Machine that takes any law, and the signals by which laws are compared.

    Attributes:
        name: of the machine.
        make: law -> scene or model.
        t_end: how long a motion is [s].
        of: which signals, or which numbers; None for the positions.
        u: inputs of the model.
        times: at which motions are compared [s]; None for equally spaced ones.
        places: fields of the scene that hold the law; None for all that hold its kind.
        free: whether the widths are parameters of one model and not numbers in each.
        backend: engine of the runs, see `simulate`.
    """

    name: str
    make: Callable[[Law], object]
    t_end: float
    of: Measure | None = None
    u: Mapping[str, Input] | None = None
    times: Array | None = None
    places: tuple[str, ...] | None = ("law",)
    free: bool = False
    backend: str = "auto"

    def model(self, law: Law) -> Model:
        """Return the model with `law`.

        Raises:
            ValueError: the machine refuses it, or gives neither scene nor model.
        """
        made = self.make(law)
        if isinstance(made, Scene):
            return made.model()
        return checks.kind(f"{self.name}({type(law).__name__})", made, Model, "a scene or a Model")


@final
@dataclass(frozen=True, eq=False)
class Sample:
    """One run.

    Attributes:
        s: factor of the widths.
        values: what they are.
        rtol: relative tolerance of the run.
        steps, attempts: of the integrator.
        time_s: CPU time of the call [s].
        motion: what was looked at, shape (signals, times).
        size: of each row, that errors are relative to.
    """

    s: float
    values: dict[str, float]
    rtol: float
    steps: int
    attempts: int
    time_s: float
    motion: Array
    size: Array


def machine_of(
    where: str,
    scene: object,
    t_end: float | None,
    of: Measure | None,
    u: Mapping[str, Input] | None,
    probe: Law,
    backend: str = "auto",
) -> Machine:
    """Return a scene, a class of scenes, or a function law -> scene or model, as a machine.

    A scene is driven as it is by default, unless `u` is given. A function is called with
    `probe` once.

    Raises:
        ValueError: none of these, no end where nothing says one.
    """
    if of is not None and not callable(of):
        of = checks.names(f"{where}: of", of)
    places: tuple[str, ...] | None = ("law",)
    make: Callable[[Law], object]
    if isinstance(scene, Scene):
        make, kind, name = partial(_in_scene, scene), type(scene), type(scene).__name__
    elif isinstance(scene, type) and issubclass(scene, Scene):
        make, kind, name = scene, scene, scene.__name__
    elif callable(scene):
        make, places = scene, None
        first = make(probe)
        if not isinstance(first, Scene | Model):
            called = f"{where}: scene({type(probe).__name__})"
            raise checks.refused(called, "a scene or a Model", first)
        kind, name = type(first), first.name if isinstance(first, Model) else type(first).__name__
    else:
        what = "a scene such as Rabinowicz, or a function law -> Model"
        raise checks.refused(f"{where}: scene", what, scene)
    end, given = driven(where, kind, t_end, u)
    return Machine(name, make, end, of, given, places=places, backend=backend)


def _in_scene(scene: Scene, law: Law) -> Scene:
    return replace(scene, law=law)


def driven(
    where: str, kind: type, t_end: float | None, u: Mapping[str, Input] | None
) -> tuple[float, Mapping[str, Input]]:
    """End [s] and inputs of a motion: those given, else those of the class `kind` of scenes.

    Raises:
        ValueError: no end where nothing says one, or one that is not positive.
    """
    given = dict(u or {})
    if issubclass(kind, Scene):
        t_end = kind.t_end if t_end is None else t_end
        given = {name: own.function for name, own in kind.inputs.items()} | given
    if t_end is None:
        raise ValueError(f"{where}: t_end: expected the end of the motion [s], got none")
    return checks.number(f"{where}: t_end", t_end, unit="s", above=0.0), given


def sample(
    machine: Machine,
    law: Law,
    rtol: float,
    s: float = 0.0,
    values: dict[str, float] | None = None,
    repeats: int = 1,
    max_steps: int = 10_000_000,
    model: Model | None = None,
) -> Sample:
    """Run `machine` with `law`, whose model it makes; timed as the fastest of `repeats` calls.

    Raises:
        SolveError: the run failed.
        KeyboardInterrupt: the user stopped it.
    """
    made = machine.model(law) if model is None else model

    def timed() -> tuple[float, Trajectory]:
        begin = process_time()
        p = values if machine.free else None
        run = simulate(
            made, machine.t_end, rtol=rtol, samples=SAMPLES, t_eval=machine.times, p=p,
            u=machine.u, max_steps=max_steps, backend=machine.backend,
        )  # fmt: skip
        return process_time() - begin, run

    spent, run = min((timed() for _ in range(repeats)), key=lambda pair: pair[0])
    if run.status is Status.INTERRUPTED:
        raise KeyboardInterrupt  # a part of a motion is no sample
    motion, size = looked_at(machine, made, run, law)
    steps, lost = run.statistics.steps, run.statistics.rejections
    return Sample(s, values or {}, rtol, steps, steps + lost, spent, motion, size)


def looked_at(machine: Machine, model: Model, run: Trajectory, law: Law) -> tuple[Array, Array]:
    """Signals on which errors are measured, shape (signals, times), and their sizes."""
    if callable(machine.of):
        found = checks.array(f"{machine.name}: of", machine.of(run), ndim=None, nan=True)
        rows = found.reshape(-1, 1)
        size = np.abs(rows)[:, 0]
        return rows, np.where(size > 0, size, 1.0)
    names = machine.of or positions(model, law)
    rows = np.array([run[name] for name in names])
    nominal = {v.name: v.nominal for v in model.x}
    least = STILL * np.array([nominal.get(name, 1.0) for name in names])
    moved = np.ptp(rows, axis=1)
    return rows, np.where(moved > least, moved, least / STILL)


def positions(model: Model, law: Law) -> tuple[str, ...]:
    """Return the states of the machine, not of friction, that are no rates of others."""
    inside = {state.name for contact in model.contacts for state in contact.states}
    inside |= {state.name for state in law.states}
    machine = [v for v in model.x if v.name not in inside and v.kind not in (FRICTION_STATE, MODE)]
    found = [v.name for v in machine if v.kind == POSITION]
    rates = {f"{v.unit}/s" for v in machine}
    return tuple(found or [v.name for v in machine if v.unit not in rates])


def distance(one: Sample, reference: Sample) -> float:
    """Largest difference of two runs at any time, relative to the size of the reference."""
    return apart(one.motion, reference.motion, reference.size)


def apart(one: Array, reference: Array, size: Array, mean: bool = False) -> float:
    """Largest difference of two motions, shape (signals, times), relative to `size`.

    With `mean` the largest root mean square, for data, which hold noise; infinite where motions do
    not compare: another number of cycles, say.
    """
    if one.shape != reference.shape or not one.size:
        return inf
    off = np.abs(one - reference)
    worst = np.sqrt((off**2).mean(axis=1)) if mean else off.max(axis=1)
    found = float((worst / size).max())
    return found if isfinite(found) else inf
