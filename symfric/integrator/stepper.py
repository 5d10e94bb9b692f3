"""A model as a plant for control loops and learning: inputs held, from sample to sample."""

from __future__ import annotations

import numpy as np

from symfric.foundation import checks
from symfric.integrator.arguments import BACKENDS, check_model, check_span, chosen, tolerances
from symfric.integrator.equations.initial import smallest_step
from symfric.integrator.equations.inputs import input_data
from symfric.integrator.plant import Numbers, Plant
from symfric.integrator.running.crossings import Memory
from symfric.integrator.running.integrator import Integrator, built
from symfric.integrator.running.plants import SAMPLES, Plants
from symfric.integrator.running.run import Tolerances
from symfric.integrator.step.layout import State
from symfric.model import Model


def stepper(
    model: Model,
    dt: float,
    *,
    t_start: float = 0.0,
    x0: Numbers | None = None,
    p: Numbers | None = None,
    batch: int | None = None,
    rtol: float = 1e-6,
    atol: float | None = None,
    method: str = "auto",
    backend: str = "auto",
    event_tolerance: float = 1e-10,
    max_steps: int = 100_000,
    max_step: float | None = None,
) -> Plant:
    """A plant of `model` that holds its inputs for `dt` [s] at a time.

        plant = stepper(drive(LuGre()), dt=1e-3)
        x = plant.step({"force": 2.0})      # or plant.step(2.0), plant.step([2.0])
        plant.t, plant["friction"]

    Adaptive steps of the method of `simulate` lie inside an interval, so that results are accurate
    whatever `dt` is; a step ends at every sample, and the memory of the step size goes on to the
    next interval. The numbers are those of one `simulate` over `Hold` samples at k dt, to the bit
    where that has 1000 intervals (its first step depends on the span), sound pivots and motions
    that are not tiny (`simulate` runs those again with an `atol` of their own).

    Args:
        model: the equations. Events happen inside the intervals; plants with events go one after
            the other, and each costs some tens of microseconds more.
        dt: interval [s] between samples.
        t_start: time [s] of the start.
        x0, p: start values and parameters by name, as in `simulate`; with `batch` arrays, too.
        batch: number of plants that go together, all by one call; then inputs, states and signals
            have a row for each plant. Compiled, eight and more go side by side in vector lanes,
            three to four times faster: the same as each alone but for rounding, and to the bit
            whoever is beside it.
        rtol, atol, method, event_tolerance, max_step: as in `simulate`.
        backend: "compiled", "vm", or "auto": compiled (once, kept in the user's cache) where there
            is a compiler.
        max_steps: attempts allowed in one interval.

    Raises:
        ValueError: bad input; no consistent start.
        CompileError: compiled code was asked for, and there is no compiler or it failed.

    Warns:
        UserWarning: rtol above 1e-5, where stick phases may get lost.
    """
    where = "stepper"
    check_model(where, model)
    dt = checks.number(f"{where}: dt", dt, unit="s", above=0.0)
    t_start = checks.number(f"{where}: t_start", t_start, unit="s")
    _, t_end, rtol = check_span(where, model, t_start, t_start + dt, rtol)
    formula = chosen(where, method, rtol)
    checks.choice(f"{where}: backend", backend, BACKENDS)
    members = 1 if batch is None else checks.count(f"{where}: batch", batch)
    # as held samples, each input is one number of the run data
    inputs = input_data(model, {v.name: float(v.start) for v in model.u}, t_start, t_end)
    integrator, _ = built(model, inputs, formula)
    allowed = tolerances(
        where, rtol, atol, integrator.system.nominal, event_tolerance, max_steps, max_step
    )
    plants = _plants(integrator, members, dt, t_start, allowed)
    plant = Plant(integrator, plants, backend, batch, allowed.event)
    plant.reset(x0, p)
    return plant


def _plants(
    integrator: Integrator, members: int, dt: float, t_start: float, allowed: Tolerances
) -> Plants:
    """Plants that have no start yet."""
    model, system = integrator.model, integrator.system
    u = np.tile(model.values("u"), (members, 1))
    d = np.hstack([np.tile(model.values("p"), (members, 1)), u])
    begin = np.full(members, t_start)
    count, ready, why, made = (np.zeros(members, dtype=np.int64) for _ in range(4))
    columns = (State.at(t_start, dt, np.zeros((members, system.n))), allowed.given(t_start, d))
    S, R = (np.ascontiguousarray(rows) for rows in columns)
    return Plants(
        S, R, u, begin, count, ready, why, made,
        dt, allowed.max_steps, smallest_step(SAMPLES * dt),
        np.tile(Memory.new(len(model.events), allowed.event), (members, 1)),
    )  # fmt: skip
