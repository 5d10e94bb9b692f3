"""Parameters that make a law smooth, its runs in a machine, and their distance from dry friction.

A smooth law has a width, such as v_t, below which it creeps instead of resting; a bristle law has a
stiffness. If all widths of a law are scaled by a factor s (and stiffnesses by 1/s), the motion
converges to that with dry, set-valued friction:

    |x(s) - x(0)| = C s^q

The order q depends on the motion as well as on the law:

    1      a contact that comes to rest and sticks: it creeps at a velocity of order v_t; with tanh
           there is an additional logarithm
    2/3    break-away over a falling branch of width v_t (Brown-McPhee): the state stays near the
           peak, the fold of the stick branch, for a long time
    1/2    reversal of bristles: the time to slide by their deflection F/sigma_0 from rest
    > 1    a contact that only slides; 3 with Brown-McPhee, whose tail decreases as (v_t/v)^3

Dry friction does not determine the loads of several contacts that rest together. With mu_s > mu_d
the instants of break-away therefore converge to a limit that depends on the smooth law. Far from
the limit there is no order: if a contact rests for longer than it moves, creep dominates.
"""

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from math import inf, isfinite
from time import process_time
from typing import final

import numpy as np

from symfric.foundation import checks
from symfric.foundation.numeric import Array, is_number
from symfric.foundation.parameters import parameters, with_values
from symfric.foundation.status import Status
from symfric.integrator import Input, Trajectory, simulate
from symfric.laws import Law
from symfric.laws.base.families import WithModes
from symfric.laws.base.law import require_law
from symfric.model import Model
from symfric.model.kinds import FRICTION_STATE, MODE, POSITION
from symfric.scenes import Scene

Measure = Sequence[str] | Callable[[Trajectory], Array]
"""Names of signals, or a function trajectory -> numbers, such as periods."""
SAMPLES = 2001
"""Number of times at which motions are compared."""
NEGLIGIBLE = 1e-9
"""Limit [m/s] below which a width only rounds an absolute value and does not smooth a law."""
DIGITS = 12
"""Number of digits to which scaled parameters are rounded."""
STILL = 1e-9
"""Ratio of motion to nominal value below which the size of a signal is its nominal value."""


@dataclass(frozen=True, eq=False)
class Regularisation:
    """Parameters that make `law` smooth, scaled together by a factor s; dry friction at s = 0.

    Attributes:
        law: the law at s = 1.
        powers: power of s for each parameter. Widths, velocities and paths are scaled by s,
            stiffnesses and inverse velocities by 1/s, and the damping of bristles by 1/sqrt(s),
            which preserves the damping ratio.
    """

    law: Law
    powers: Mapping[str, float]

    def values(self, s: float) -> dict[str, float]:
        """Return the values of the scaled parameters at the factor `s`."""
        known = parameters(self.law)
        scaled = {n: float(known[n].value) * s**power for n, power in self.powers.items()}
        return {n: float(f"{value:.{DIGITS}g}") for n, value in scaled.items()}

    def at(self, s: float) -> Law:
        """Return the law at the factor `s`."""
        return with_values(self.law, self.values(s))


def regularisation(
    where: str, law: Law, parameter: str | Iterable[str] | None = None
) -> Regularisation:
    """Return the parameters that make `law` smooth: `parameter`, or by default those of some roles.

    These roles are stiffness, damping and length of bristles, transition velocities named v_t, and
    smoothing widths [m/s]. If a law has none of these, its only velocity scale is used.

    Raises:
        ValueError: `law` is not a law, a parameter does not exist, or the law has several velocity
            scales and `parameter` is not given.
    """
    require_law(f"{where}: law", law)
    known = parameters(law)
    if parameter is not None:
        given = [parameter] if isinstance(parameter, str) else parameter
        names = checks.names(f"{where}: parameter", given, known)
        if not names:
            raise ValueError(f"{where}: parameter: expected the names of one or more, got none")
        return _scaled(where, law, names)
    if isinstance(law, WithModes) and law.has_mode:
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
    return _scaled(where, law, found)


def _scaled(where: str, law: Law, names: Iterable[str]) -> Regularisation:
    """Return the parameters `names` with their powers; raise an error for values <= 0."""
    powers: dict[str, float] = {}
    for name in names:
        p = parameters(law)[name]
        if not is_number(p.value) or not float(p.value) > 0.0:
            raise checks.refused(f"{where}: law: {name}", "a number > 0 to start from", p.value)
        inverse = p.role == "stiffness" or p.unit in ("s/m", "s/rad", "1/m")
        powers[name] = -0.5 if p.role == "damping" else -1.0 if inverse else 1.0
    return Regularisation(law, powers)


@final
@dataclass(frozen=True, eq=False)
class Machine:
    """Machine that accepts any law, and the signals by which laws are compared.

    Attributes:
        name: name of the machine.
        make: function law -> scene or model.
        t_end: length of the motion [s].
        of: compared signals or numbers; None for the positions.
        u: inputs of the model.
        times: times of the comparison [s]; None for equally spaced times.
        places: fields of the scene that contain the law; None for all fields with a law of its
            class.
        free: True if the widths are parameters of one model, False if they are constants of it.
        backend: backend of the runs, see `simulate`.
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
            ValueError: the machine rejects the law, or `make` returns neither scene nor model.
        """
        made = self.make(law)
        if isinstance(made, Scene):
            return made.model()
        return checks.kind(f"{self.name}({type(law).__name__})", made, Model, "a scene or a Model")


@final
@dataclass(frozen=True, eq=False)
class Sample:
    """Run of a law in a machine.

    Attributes:
        s: factor of the widths.
        values: the scaled parameters.
        rtol: relative tolerance of the run.
        steps, attempts: accepted and attempted steps of the integrator.
        time_s: CPU time of the call [s].
        motion: compared signals, shape (signals, times).
        size: size of each row, to which errors are relative.
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
    """Return the machine of a scene, a class of scenes, or a function law -> scene or model.

    Its inputs are those of the scene, updated by `u`. A function is called once with `probe`.

    Raises:
        ValueError: `scene` is none of these, or the end of the motion is unknown.
    """
    if of is not None and not callable(of):
        of = checks.names(f"{where}: of", of)
    places: tuple[str, ...] | None = ("law",)
    make: Callable[[Law], object]
    if isinstance(scene, Scene):
        first, make = scene, partial(_in_scene, scene)
    elif isinstance(scene, type) and issubclass(scene, Scene):
        first, make = scene(probe), scene
    elif callable(scene):
        first, make, places = scene(probe), scene, None
        if not isinstance(first, Scene | Model):
            called = f"{where}: scene({type(probe).__name__})"
            raise checks.refused(called, "a scene or a Model", first)
    else:
        expected = "a scene such as Rabinowicz, or a function law -> Model"
        raise checks.refused(f"{where}: scene", expected, scene)
    name = first.name if isinstance(first, Model) else type(first).__name__
    end, given = driven(where, type(first), t_end, u)
    return Machine(name, make, end, of, given, places=places, backend=backend)


def _in_scene(scene: Scene, law: Law) -> Scene:
    return replace(scene, law=law)


def driven(
    where: str, kind: type, t_end: float | None, u: Mapping[str, Input] | None
) -> tuple[float, Mapping[str, Input]]:
    """Return the end [s] and the inputs of a motion, by default those of the class `kind`.

    Raises:
        ValueError: the end is unknown or not positive.
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
    """Run `machine` with `law`, in `model` if given; the time is the shortest of `repeats` runs.

    Raises:
        SolveError: the run failed.
        KeyboardInterrupt: the user interrupted the run.
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
        raise KeyboardInterrupt  # an incomplete motion cannot be compared
    motion, size = looked_at(machine, made, run, law)
    steps, lost = run.statistics.steps, run.statistics.rejections
    return Sample(s, values or {}, rtol, steps, steps + lost, spent, motion, size)


def looked_at(machine: Machine, model: Model, run: Trajectory, law: Law) -> tuple[Array, Array]:
    """Return the compared signals, shape (signals, times), and their sizes."""
    if callable(machine.of):
        numbers = checks.array(f"{machine.name}: of", machine.of(run), ndim=None, nan=True)
        rows = numbers.reshape(-1, 1)
        size = np.abs(rows)[:, 0]
        return rows, np.where(size > 0, size, 1.0)
    names = machine.of or positions(model, law)
    rows = np.array([run[name] for name in names])
    nominal = {v.name: v.nominal for v in model.x}
    least = STILL * np.array([nominal.get(name, 1.0) for name in names])
    moved = np.ptp(rows, axis=1)
    return rows, np.where(moved > least, moved, least / STILL)


def positions(model: Model, law: Law) -> tuple[str, ...]:
    """Return the states of the machine that are neither friction states nor rates of others."""
    inside = {state.name for contact in model.contacts for state in contact.states}
    inside |= {state.name for state in law.states}
    machine = [v for v in model.x if v.name not in inside and v.kind not in (FRICTION_STATE, MODE)]
    found = [v.name for v in machine if v.kind == POSITION]
    rates = {f"{v.unit}/s" for v in machine}
    return tuple(found or [v.name for v in machine if v.unit not in rates])


def distance(one: Sample, reference: Sample) -> float:
    """Return the largest difference of two runs relative to the size of the reference."""
    return apart(one.motion, reference.motion, reference.size)


def apart(one: Array, reference: Array, size: Array, mean: bool = False) -> float:
    """Return the largest difference of two motions, shape (signals, times), relative to `size`.

    With `mean` it is the largest root mean square, for data with noise. It is infinite for motions
    of different shapes, for example with different numbers of cycles.
    """
    if one.shape != reference.shape or not one.size:
        return inf
    off = np.abs(one - reference)
    worst = np.sqrt((off**2).mean(axis=1)) if mean else off.max(axis=1)
    found = float((worst / size).max())
    return found if isfinite(found) else inf
