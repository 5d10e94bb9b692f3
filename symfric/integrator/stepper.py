"""Steps of a model from sample to sample: plants for control loops, differentiable flow maps."""

from __future__ import annotations

import casadi as ca
import numpy as np

from symfric.foundation import checks
from symfric.integrator.compiled.columns import BACKENDS
from symfric.integrator.equations.initial import first_guess, smallest_step
from symfric.integrator.equations.inputs import InputData, input_data
from symfric.integrator.equations.manifold import Manifold
from symfric.integrator.equations.system import System, system
from symfric.integrator.methods.attempt import SRow, build_fixed
from symfric.integrator.methods.method import suited_to_start
from symfric.integrator.methods.tableaux import METHODS, chosen
from symfric.integrator.plant import Numbers, Plant
from symfric.integrator.prepared import check_span, tolerances
from symfric.integrator.running.crossings import Memory
from symfric.integrator.running.integrator import built
from symfric.integrator.running.plants import SAMPLES, Plants
from symfric.model import Model, check_model


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
    """Return a plant of `model` that holds its inputs for `dt` [s] at a time.

        plant = stepper(drive(LuGre()), dt=1e-3)
        x = plant.step({"force": 2.0})      # or plant.step(2.0), plant.step([2.0])
        plant.t, plant["friction"]

    Each interval takes adaptive steps of the method of `simulate`, so results are accurate for any
    `dt`. A step ends at every sample, and the step size control continues in the next interval.
    The results equal those of one `simulate` over `Hold` samples at k dt. They agree bit for bit
    if that run has 1000 intervals (its first step depends on the span), stable pivots, and motions
    that are not tiny (`simulate` repeats tiny motions with a smaller `atol`).

    Args:
        model: the equations. Events may occur inside the intervals; plants with events advance one
            after the other, and each takes some tens of microseconds more.
        dt: interval [s] between samples.
        t_start: time [s] of the start.
        x0, p: start values and parameters by name, as in `simulate`; with `batch` also arrays.
        batch: number of plants that advance together in one call; inputs, states and signals then
            have one row per plant. Compiled code advances eight or more plants in parallel in
            vector lanes, three to four times faster. The results equal those of a single plant up
            to rounding and do not depend on the other plants.
        rtol, atol, method, event_tolerance, max_step: as in `simulate`.
        backend: "compiled", "vm", or "auto": compiled (once, kept in the user's cache) if there is
            a compiler.
        max_steps: largest number of attempts in one interval.

    Raises:
        ValueError: bad input, or no consistent start.
        CompileError: compiled code was requested without a working compiler.

    Warns:
        UserWarning: rtol above 1e-5, where stick phases may be missed.
    """
    where = "stepper"
    check_model(where, model)
    dt = checks.number(f"{where}: dt", dt, unit="s", above=0.0)
    t_start = checks.number(f"{where}: t_start", t_start, unit="s")
    _, t_end, rtol = check_span(where, model, t_start, t_start + dt, rtol)
    formula = chosen(where, method, rtol)
    checks.choice(f"{where}: backend", backend, BACKENDS)
    members = 1 if batch is None else checks.count(f"{where}: batch", batch)
    # constant inputs have one entry each in the run data
    inputs = input_data(model, {v.name: float(v.start) for v in model.u}, t_start, t_end)
    integrator, _ = built(model, inputs, formula)
    allowed = tolerances(
        where, rtol, atol, integrator.system.nominal, event_tolerance, max_steps, max_step
    )
    u = np.tile(model.values("u"), (members, 1))
    d = np.hstack([np.tile(model.values("p"), (members, 1)), u])
    start = SRow.at(t_start, dt, np.zeros((members, integrator.system.n)))
    S, R = (np.ascontiguousarray(rows) for rows in (start, allowed.given(t_start, d)))
    count, ready, why, made = (np.zeros(members, dtype=np.int64) for _ in range(4))
    plants = Plants(
        S, R, u, np.full(members, t_start), count, ready, why, made,
        dt, allowed.max_steps, smallest_step(SAMPLES * dt),
        np.tile(Memory.new(len(model.events), allowed.event), (members, 1)),
    )  # fmt: skip
    plant = Plant(integrator, plants, backend, batch, allowed.event)
    plant.reset(x0, p)
    return plant


def flow(model: Model, *, steps: int = 20, method: str = "rodas5p") -> ca.Function:
    """Return the flow of a model as a CasADi Function (x0, u, p, T) -> xf, for the user's own NLP.

        xf = x(T),   x(0) = x0,   u and p constant

    The function takes `steps` equal steps of the method; CasADi provides its derivatives of any
    order, exact for the discrete map. Time in the equations starts at 0. Newton's method computes
    consistent algebraic variables from their start values. Compare a result with `simulate`: fixed
    steps have no error control and do not detect friction that jams.

    Args:
        model: explicit or implicit model without events.
        steps: number of steps; choose it so that h = T/steps resolves the transition velocity.
        method: as in `simulate`, or one for fixed steps: "backward_euler" (order 1, bounded even
            if h does not resolve the transition), "exponential" (order 1, one evaluation).

    Raises:
        ValueError: an unknown method, a model with events, or fewer than one step.
    """
    check_model("flow", model)
    checks.choice("flow: method", method, METHODS)
    steps = checks.count("flow: steps", steps)
    if model.events:
        raise ValueError(
            f"flow: expected a model without events, got {len(model.events)} in '{model.name}'; "
            "remove your own events, and use a smooth or bristle law"
        )
    u = model.vector("u")
    whole = system(model, InputData(u, u, np.zeros(2), np.zeros((len(model.u), 1)), ("flow",)))
    whole = suited_to_start(whole, METHODS[method], model)
    fixed = build_fixed(whole, METHODS[method])
    x0, inputs = ca.MX.sym("x0", len(model.x)), ca.MX.sym("u", len(model.u))
    p, T = ca.MX.sym("p", len(model.p)), ca.MX.sym("T")
    data = ca.vertcat(p, inputs)
    chain = fixed.mapaccum("chain", steps)
    start = _start(model, whole, x0, data)
    all_y = chain(start, ca.repmat(T / steps, 1, steps), ca.repmat(data, 1, steps))
    xf = all_y[: len(model.x), -1]
    return ca.Function("flow", [x0, inputs, p, T], [xf], ["x0", "u", "p", "T"], ["xf"])


def _start(model: Model, whole: System, x0: ca.MX, data: ca.MX) -> ca.MX:
    """Return all unknowns at time 0, with consistent algebraic unknowns."""
    guess = first_guess(whole, model, np.zeros(whole.nx))[whole.nx :]
    y, free = ca.vertcat(x0, ca.DM(guess)), ca.DM(whole.free)
    if whole.manifold is not None:
        y = _on_constraints(whole, whole.manifold)(y, data)
    if free.numel():
        change = ca.SX.sym("change", free.shape[1])
        g = ca.substitute(whole.f[whole.algebraic[0]], whole.y, whole.y + free @ change)
        problem = {"x": change, "p": ca.vertcat(whole.y, whole.d), "g": g}
        newton = ca.rootfinder("consistent", "newton", problem, {"error_on_fail": True})
        y = y + free @ newton(0, ca.vertcat(y, data))
    return y


def _on_constraints(whole: System, manifold: Manifold) -> ca.Function:
    """Return the projection (y, d) -> y on the constraints, with a tangent basis if needed."""
    y = ca.SX(manifold.project(whole.y, whole.d))
    if manifold.charted:
        phi = manifold.defect(whole.y, whole.d)[: manifold.m]
        slope = ca.Function("slope", [whole.y, whole.d], [ca.jacobian(phi, whole.y[: manifold.n])])
        y[list(manifold.basis)] = ca.vec(ca.nullspace(ca.densify(slope(y, whole.d))))
    return ca.Function("on_constraints", [whole.y, whole.d], [y], {"cse": True})
