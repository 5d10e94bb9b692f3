"""Simulation of a model: one function for every method and engine."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from functools import partial

import numpy as np
from numpy.typing import ArrayLike, NDArray

from symfric.foundation import checks
from symfric.integrator.derivatives.path import RunPath, seeds
from symfric.integrator.derivatives.sensitivity import Differentiated
from symfric.integrator.equations.inputs import Input
from symfric.integrator.methods.tableaux import FOR_DERIVATIVES, another
from symfric.integrator.prepared import check_flags, checked, prepared
from symfric.integrator.running.run import own_scale
from symfric.integrator.stored import Basis, Stored
from symfric.model import Model, check_model
from symfric.results.trajectory import Trajectory

NOTHING = 1e-9
"""Derivatives below this multiple of their nominal value are treated as rounding errors."""


def difference(model: Model, one: Trajectory, other: Trajectory) -> float:
    """Return the largest difference of a state between two runs, relative to its magnitude.

    The magnitude is the nominal value of the state, or its largest value if that is larger or tiny
    (`own_scale`).
    """
    n = min(one.t.size, other.t.size)
    worst = 0.0
    for v in model.x:
        a, b = one[v.name][:n], other[v.name][:n]
        size, nominal = np.abs(b).max(), np.array(v.nominal)
        scale = np.maximum(size, own_scale(size, nominal))
        worst = max(worst, float(np.abs(a - b).max() / scale))
    return worst


def differences_of_derivatives(
    model: Model, names: Sequence[str], one: Trajectory, other: Trajectory
) -> dict[str, float]:
    """Return the largest difference of each derivative between two runs.

    The difference is relative to the largest value of the derivative. Derivatives jump at events,
    so times at which only one of the runs has passed an event are not compared.

    Returns:
        Name -> relative difference; NaN for all names if the derivative at an event is undefined
        (reported by `Trajectory.sensitivities`).
    """
    try:
        found, finer = one.sensitivities, other.sensitivities
    except ValueError:
        return dict.fromkeys(names, float("nan"))
    n = min(one.t.size, other.t.size)
    same = _on_the_same_side(one, other)[:n]
    known = {v.name: v for v in model.p} | {f"x0.{v.name}": v for v in model.x}
    worst = dict.fromkeys(names, 0.0)
    for name in names:
        for v in model.x:
            a, b = found[name][v.name][:n], finer[name][v.name][:n]
            size = max(float(np.abs(b).max()), NOTHING * v.nominal / known[name].nominal)
            off = float(np.abs(a - b)[same].max(initial=0.0)) / size
            worst[name] = max(worst[name], off)
    return worst


def _on_the_same_side(one: Trajectory, other: Trajectory) -> NDArray[np.bool_]:
    """Return True for each time of `one` that has equally many events of both runs before it.

    If the runs differ in their total number of events, return True for all times.
    """
    times = [np.array([t for t, _ in run.happened]) for run in (one, other)]
    if times[0].size != times[1].size:
        return np.ones(one.t.size, dtype=bool)
    before = [np.searchsorted(found, one.t, side="right") for found in times]
    return before[0] == before[1]


def simulate(
    model: Model,
    t_end: float,
    *,
    t_start: float = 0.0,
    x0: Mapping[str, float] | None = None,
    u: Mapping[str, Input] | None = None,
    p: Mapping[str, float] | None = None,
    rtol: float = 1e-6,
    atol: float | None = None,
    t_eval: ArrayLike | None = None,
    samples: int = 2001,
    method: str = "auto",
    backend: str = "auto",
    event_tolerance: float = 1e-10,
    max_steps: int | None = None,
    max_step: float | None = None,
    times: ArrayLike = (),
    sensitivities: Sequence[str] = (),
    measure_error: bool = False,
    progress: Callable[[float], None] | None = None,
    throw: bool = True,
) -> Trajectory:
    """Integrate `model` from `t_start` to `t_end` [s].

    Args:
        model: the equations, with their events and monitored expressions.
        t_end: last time [s].
        t_start: first time [s].
        x0: start values of states by name; the other states start at the model's defaults (those
            of bristles are steady sliding, those of modes the direction of sliding). A given mode
            must agree with the sliding velocity.
        u: inputs by name: a number, `Hold` or `Linear` samples, or a function of symbolic time. A
            function is sampled at 8193 times and within its jumps to detect short pulses; list in
            `times` the pulses that lie between two samples and have no jump.
        p: values of the model's parameters by name.
        rtol: relative tolerance of each step.
        atol: absolute tolerance in multiples of each state's nominal value; default 0.1 rtol. For
            motions below 1e-3 nominal the default is scaled to the size of the motion, found by a
            first run. Motion below 1e-12 nominal is treated as zero.
        t_eval: times of the result [s]; default `samples` equally spaced times. No step has to end
            at them.
        samples: number of equally spaced times.
        method: the formula; the numbers below refer to Rabinowicz's stick-slip over 20 s.
            "auto": rodas5p, or radau5 if rtol > 1e-5 or if derivatives are requested; steps are
            then at most half a law's width where it slides slowly.
            "rodas5p": order 5, the fewest steps at 1e-6 and below; error about rtol.
            "rodas4p": order 4; a step costs 2/3 of one of rodas5p, but the number of steps grows
            faster with tighter rtol.
            "rodas3": order 3; for comparisons with fixed-step plants.
            "radau5": order 5, the most robust method: its iteration fails if a contact changes
            within a step, so no slip is missed even at rtol = 1e-3. The error is a tenth of rtol,
            for 1.5 to 2 times the steps; between steps the order is 4.
            "radau9": order 9, five stages, for errors below 1e-7: a third of the time of rodas5p at
            1e-8 and a fifth at 1e-10 with Brown-McPhee friction, but 0.95 and 0.75 times with
            LuGre, whose corners limit the steps, and no gain with algebraic unknowns. "auto" never
            chooses it: as with radau5, rounding stops the progress with narrow laws at tight
            tolerances (v_t = 1e-8 m/s at 1e-9), a decade before rodas5p.
            "dopri5": order 5, explicit, for non-stiff ODEs: orbits, pendulums, contacts that only
            slide, and mechanisms without friction from reactions (their multipliers have no error
            estimate). With bristles and sticking it needs 20 to 100 times the steps. "auto" never
            chooses it, since no cheap test proves that an equation is not stiff.
        backend: the engine: "vm" needs no compiler; "compiled" compiles the step once and keeps
            it in the user's cache; "auto" starts in the VM, compiles the step in a background
            thread if that is expected to save time, and switches to the compiled step once it is
            available, in this run or a later one. The functions of signals are treated likewise.
            Both engines give the same bits. For third-party integrators see `simulate_by_peer`.
        event_tolerance: events closer than this [s] are simultaneous; event times are accurate to
            a thousandth of it, or to rounding.
        max_steps: largest number of attempts. By default a run takes as many as it needs, unless
            the last 10 million advance so little that a billion more would not reach `t_end`.
        max_step: longest step [s]; unlimited by default. Set it for features that error control
            cannot detect in advance, such as short pulses of a function of time in the equations.
        times: increasing times [s] at which a step has to end.
        sensitivities: names of free parameters, and of start values as "x0.v". The trajectory then
            gives the derivatives of all signals (`Trajectory.sensitivities`), gradients of sums of
            signals (`Trajectory.gradient`) and derivatives of event times
            (`Trajectory.event_sensitivities`), exact for the steps that were taken. Error control
            monitors states only, and derivatives have larger errors: at rtol = 1e-6, 1e-5 of their
            largest value with smooth laws, 1e-4 or 1e-3 of a peak where bristles slip or bearings
            are unloaded for a moment. A `method` given by name takes the same steps as without
            derivatives.
        measure_error: repeat the run at rtol/100, with another formula and steps half as long, and
            report the difference in the statistics, including that of each of `sensitivities`.
        progress: called with the fraction done every few tens of milliseconds.
        throw: raise `SolveError` on failure; with False the partial trajectory is returned.

    Returns:
        The trajectory. After an interrupt (Ctrl-C) its status is INTERRUPTED.

    Raises:
        ValueError: bad input.
        SolveError: the integration failed; its `partial` is the trajectory so far.

    Warns:
        UserWarning: rtol above 1e-5, where stick phases may be missed.
        OverloadWarning: friction above its static level, for example from a bristle that does not
            relax. The run is still returned; its `doubts` give the contact and the time.
        LimitWarning: a state or an input leaves the bounds of its `Variable`.
        EnergyWarning: friction adds energy to the motion, for example a law with the wrong sign.
    """
    check_model("simulate", model)
    check_flags("simulate", progress, measure_error=measure_error, throw=throw)
    limits = event_tolerance, max_steps, max_step
    asked = t_start, t_end, rtol, atol, samples, method, backend, *limits
    ready, looks = prepared("simulate", model, asked, t_eval)
    if sensitivities != ():
        sensitivities = checks.names("simulate: sensitivities", sensitivities)
        formula = FOR_DERIVATIVES if method == "auto" else ready.method
        ready = replace(ready, method=formula, u=u, stops=times)
    elif u is not None or not (isinstance(times, tuple) and not times):
        ready = replace(ready, u=u, stops=times)
    which = seeds(model, sensitivities, x0, p, ready.t_start) if sensitivities else None
    trajectory, run, own, y0, values = ready.run("simulate", x0, p, looks, progress)
    if throw:
        checked(trajectory)
    allowed, inputs = ready.tolerances, ready.inputs
    if which is not None and run.steps:
        basis = Basis(which, y0, tuple(run.jumps), allowed.event)
        known = trajectory.t, run.outputs.reached
        jumps = basis.jumps, basis.tolerance, known
        path = partial(RunPath, own, run.dense, inputs, values, backend, y0, *jumps)
        found = Differentiated(path, which, tuple(trajectory.units), trajectory.t)
        trajectory = replace(
            trajectory, differentiate=found.at, pull_back=found.pull_back, delays=found.delays,
            keep=partial(Stored.of, ready.integrator, inputs, run, values, backend, basis=basis),
        )  # fmt: skip
    if measure_error and trajectory.status.ok:
        finer = simulate(
            model, t_end, t_start=t_start, x0=x0, u=u, p=p, rtol=max(allowed.rtol / 100, 1e-13),
            atol=None if atol is None else atol / 100, event_tolerance=event_tolerance,
            t_eval=trajectory.t, method=another(ready.method), backend=backend,
            max_step=run.extent.longest / 2, times=times, sensitivities=sensitivities,
        )  # fmt: skip
        off = difference(model, trajectory, finer)
        slopes = differences_of_derivatives(model, sensitivities, trajectory, finer)
        measured = replace(trajectory.statistics, error=off, sensitivity_errors=slopes)
        trajectory = replace(trajectory, count=lambda: measured)
    return trajectory
