"""Simulation of a controller on a plant, and an independent check of its plans.

The check evaluates the optimality conditions by derivatives of CasADi and shares only the
expressions of the horizon with the solver. The program over all states and inputs is differentiated
as one expression. The multipliers of the equations follow from a linear system, in which the
gradient in the states is zero.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, final

import casadi as ca
import numpy as np
from numpy.typing import ArrayLike, NDArray

from ocp.formulation.phase import Array
from ocp.mpc.design import CycleData, CycleStatus, Design, Plan
from ocp.mpc.session import Action, Session
from symfric.foundation import checks
from symfric.foundation.files import write_table
from symfric.foundation.numeric import evaluate_all
from symfric.foundation.panels import legend_below, panels, save
from symfric.foundation.shown import brief
from symfric.foundation.style import line
from symfric.integrator.stepper import stepper
from symfric.model import Model, check_model

if TYPE_CHECKING:
    from matplotlib.figure import Figure


Reference = float | Callable[[Array], ArrayLike]
"""A number, or a function of times [s]."""

FROM_ACTIONS = (
    "residual", "seconds", "cpu", "iterations", "program_iterations", "violation",
)  # fmt: skip
"""Attributes of each action that a run stores."""
SLACK = 1e-3
"""Relative difference between a residual and its check that counts as rounding error."""


@final
class Optimality:
    """Independent computation of residuals of plans of a controller."""

    def __init__(self, design: Design) -> None:
        h = design.horizon
        self._design, self._states = design, h.x.numel() * h.count
        X, U = ca.MX.sym("X", h.x.numel(), h.count + 1), ca.MX.sym("U", h.u.numel(), h.count)
        R, t = ca.MX.sym("R", h.r.numel(), h.count + 1), ca.MX.sym("t", 1, h.count + 1)
        p, b = ca.MX.sym("p", h.p.numel()), ca.MX.sym("b", h.b.numel())
        to = h.x
        for _ in range(h.substeps):
            to = h.advance(to, h.u, h.r, h.p)
        symbols = [h.x, h.u, h.after, h.r, h.r_after, h.p, h.t, h.b]
        results = [to - h.after, h.v, h.early.value + h.late.value]
        interval = ca.Function("interval", symbols, results)
        end = ca.Function("end", [h.x, h.r, h.p, h.t, h.b], [h.v_end, h.end.value])
        c, v, q = interval.map(h.count, [False] * 5 + [True, False, True], [False] * 3)(
            X[:, :-1], U, X[:, 1:], R[:, :-1], R[:, 1:], p, t[:, :-1], b
        )
        v_end, q_end = end(X[:, -1], R[:, -1], p, t[:, -1], b)
        every = ca.vertcat(ca.vec(v), v_end)
        m = ca.MX.sym("m", every.numel())
        lagrangian = ca.sum2(q) + q_end - ca.dot(m, every)
        gradient = ca.vertcat(
            ca.vec(ca.gradient(lagrangian, X)[:, 1:]), ca.vec(ca.gradient(lagrangian, U))
        )
        slopes = ca.horzcat(ca.jacobian(ca.vec(c), X)[:, h.x.numel() :], ca.jacobian(ca.vec(c), U))
        results = [ca.densify(gradient), ca.densify(slopes), ca.vec(c), every]
        self._whole = ca.Function("whole", [X, U, R, t, p, b, m], results)

    def residual(self, plan: Plan, data: CycleData) -> float:
        """Return the residual of a plan as defined in `ocp.mpc.source`."""
        h, prices = self._design.horizon, self._design.prices
        gradient, slopes, c, v = evaluate_all(
            self._whole, plan.X, plan.U, data.R, data.t, data.p, data.b, plan.z
        )
        n, model = self._states, h.model
        by_states, by_inputs = slopes[:, :n], slopes[:, n:]
        multipliers = np.linalg.solve(by_states.T, -gradient[:n, 0])
        left = (gradient[n:, 0] + by_inputs.T @ multipliers) * np.tile(model.nominal("u"), h.count)
        defects = c[:, 0] / np.tile(model.nominal("x"), h.count)
        v, below = v[:, 0], np.maximum(-v[:, 0], 0.0)
        kept = np.maximum(below, np.abs(plan.z * v) / np.maximum(plan.z, h.curvature))
        soft = prices > 0.0
        owed = (prices + prices * below - plan.z) * v / np.where(soft, prices, 1.0)
        rows = np.where(soft & (v < 0.0), np.minimum(kept, np.abs(owed)), kept)
        parts = (left / h.curvature, defects, rows)
        return max(float(np.abs(part).max(initial=0.0)) for part in parts)


@final
@dataclass(frozen=True, eq=False)
class ClosedLoopRun:
    """Run of a plant with a controller; arrays have an entry for each of the n cycles.

    Attributes:
        plant, controller: names of plant and controller.
        t: times of the cycles [s].
        t_end: end time [s].
        signals: signals of the plant at each cycle and at `t_end`, shape (n + 1,).
        units: units of signals and controls.
        controls: input -> value over the interval after each cycle.
        references: name -> value at each cycle.
        residual: residual reported by the controller.
        checked: residual by the independent check (`Optimality`); NaN without check.
        seconds, cpu: wall time and processor time of each cycle [s]; the wall time includes other
            programs on a busy machine.
        iterations, program_iterations: numbers of quadratic programs and of interior-point
            iterations.
        violation: largest violation of a soft bound in the plan, in units of its signal.
        status: status of each cycle as a number of `CycleStatus`.
        tolerance: tolerance of the residual.
    """

    plant: str
    controller: str
    t: Array
    t_end: float
    signals: Mapping[str, Array]
    units: Mapping[str, str]
    controls: Mapping[str, Array]
    references: Mapping[str, Array]
    residual: Array
    checked: Array
    seconds: Array
    cpu: Array
    iterations: NDArray[np.int64]
    program_iterations: NDArray[np.int64]
    violation: Array
    status: NDArray[np.int64]
    tolerance: float

    __repr__ = brief

    def __getitem__(self, name: str) -> Array:
        checks.check_names(f"loop of '{self.plant}'", [name], [*self.signals, *self.controls])
        return self.signals[name] if name in self.signals else self.controls[name]

    @property
    def median(self) -> float:
        """Median wall time of a cycle [s]."""
        return float(np.median(self.seconds))

    @property
    def worst(self) -> float:
        """Longest wall time of a cycle [s]."""
        return float(self.seconds.max())

    @property
    def worst_cpu(self) -> float:
        """Longest processor time of a cycle [s]."""
        return float(self.cpu.max())

    @property
    def unconverged(self) -> int:
        """Number of cycles with a status other than CONVERGED."""
        return int(np.count_nonzero(self.status != CycleStatus.CONVERGED))

    @property
    def unreported(self) -> int:
        """Number of cycles reported as converged whose residual or check exceeds the tolerance.

        It should be zero.
        """
        reported = self.status == CycleStatus.CONVERGED
        allowed = self.tolerance * (1.0 + SLACK)
        wrong = ~(self.residual <= self.tolerance) | (self.checked > allowed)
        return int(np.count_nonzero(reported & wrong))

    def to_dict(self) -> dict[str, Any]:
        """Return the numbers of `table` as plain data."""
        finite = self.residual[np.isfinite(self.residual)]
        return {
            "controller": self.controller,
            "plant": self.plant,
            "cycles": int(self.seconds.size),
            "median_s": self.median,
            "worst_s": self.worst,
            "worst_cpu_s": self.worst_cpu,
            "most_iterations": int(self.iterations.max(initial=0)),
            "worst_residual": float(finite.max(initial=0.0)),
            "not_converged": self.unconverged,
            "unreported": self.unreported,
        }

    def table(self) -> str:
        """Return a summary of a few lines."""
        d = self.to_dict()
        return (
            f"{self.controller} on plant '{self.plant}', {d['cycles']} cycles to {self.t_end:g} s\n"
            f"  cycle time      median {1e3 * self.median:.3f} ms, worst {1e3 * self.worst:.3f} ms "
            f"(processor {1e3 * self.worst_cpu:.3f} ms)\n"
            f"  iterations      median {np.median(self.iterations):g}, most "
            f"{d['most_iterations']}\n"
            f"  residual        median {np.median(self.residual):.1e}, worst "
            f"{d['worst_residual']:.1e}, tolerance {self.tolerance:.0e}\n"
            f"  not converged   {self.unconverged} of {d['cycles']}, as reported\n"
            f"  unreported      {self.unreported}"
        )

    def to_csv(self, path: str | Path) -> None:
        """Write one row per cycle with time, signals, controls, references, residual and status."""
        columns: dict[str, Array] = {"t [s]": self.t}
        signals = {name: values[:-1] for name, values in self.signals.items()}
        for name, values in (signals | dict(self.controls)).items():
            columns[f"{name} [{self.units[name]}]"] = values
        columns |= {f"{name} (reference)": values for name, values in self.references.items()}
        columns |= {"residual": self.residual, "iterations": self.iterations.astype(float)}
        columns |= {"status": self.status.astype(float), "time [s]": self.seconds}
        write_table(path, columns, np.column_stack(list(columns.values())).tolist())

    def plot(self, *names: str, path: str | Path | None = None) -> Figure:
        """Plot signals, controls and cycle times over time, one panel each; see `plot_loops`.

        Args:
            names: signals and controls to show, by default all.
            path: image file.
        """
        return plot_loops({f"{self.controller} on plant '{self.plant}'": self}, names, path)


def plot_loops(
    loops: Mapping[str, ClosedLoopRun], names: Sequence[str] = (), path: str | Path | None = None
) -> Figure:
    """Plot signals and controls of closed loops over time, one panel each, and cycle times.

    Shaded cycles did not converge according to their status.

    Args:
        loops: legend entry -> run.
        names: signals and controls to show, by default all that the runs have in common.
        path: image file.
    """
    first = next(iter(loops.values()))
    known = [*first.signals, *first.controls]
    shared = [n for n in known if all(n in {*one.signals, *one.controls} for one in loops.values())]
    checks.check_names(f"loop of '{first.plant}'", names, shared)
    shown = list(names) or shared
    figure, axes = panels(len(shown) + 1)
    for number, (label, one) in enumerate(loops.items()):
        look, edges = line(number), np.append(one.t, one.t_end)
        for axis, name in zip(axes, shown, strict=False):
            if name in one.controls:
                axis.stairs(one.controls[name], edges, baseline=None, label=label, **look)
            else:
                axis.plot(edges, one.signals[name], linewidth=1.2, label=label, **look)
            axis.set_ylabel(f"{name} [{one.units[name]}]")
        axes[-1].semilogy(one.t, 1e3 * one.cpu, ".", ms=3, color=look["color"])
        for k in np.flatnonzero(one.status != CycleStatus.CONVERGED).tolist():
            for axis in axes:
                axis.axvspan(edges[k], edges[k + 1], color=look["color"], alpha=0.15, linewidth=0)
    axes[-1].set_ylabel("cycle [ms]")
    axes[-1].set_xlabel("t [s]")
    if len(loops) > 1:
        legend_below(figure, axes[0], 4, fontsize="small")
    else:
        axes[0].set_title(next(iter(loops)))
    figure.align_ylabels(axes)
    return save(figure, path)


def run_closed_loop(
    session: Session,
    plant: Model,
    t_end: float,
    references: Mapping[str, Reference],
    *,
    x0: Mapping[str, float] | None,
    p: Mapping[str, float] | None,
    plant_p: Mapping[str, float] | None,
    noise: Mapping[str, float] | None,
    seed: int,
    check: bool,
) -> ClosedLoopRun:
    """Simulate a closed loop; see `Controller.simulate`."""
    where, design = "simulate", session.design
    check_model(where, plant)
    h, measured = design.horizon, design.measured_names
    t_end = checks.number(f"{where}: t_end", t_end, unit="s", above=0.0)
    driven, inputs = [c.name for c in design.controls], [v.name for v in plant.u]
    checks.check_names(f"{where}: inputs of plant '{plant.name}'", driven, inputs)
    checks.check_names(f"{where}: signals of plant '{plant.name}'", measured, plant.signals)
    spread = checks.named(f"{where}: noise", noise, measured)
    checks.named(f"{where}: references", references, h.references)
    run = stepper(plant, h.step, x0=x0, p=plant_p)
    check_of = Optimality(design) if check else None
    random, cycles = np.random.default_rng(seed), max(1, round(t_end / h.step))
    signals, actions, checked = [run.signals], list[Action](), list[float]()
    ahead: list[dict[str, Array]] = []
    while len(actions) < cycles and not run.terminated:
        t = len(actions) * h.step
        times = t + h.step * np.arange(h.count + 1.0)
        ahead.append({name: _values(value, times) for name, value in references.items()})
        x = {n: run[n] + spread.get(n, 0.0) * random.standard_normal() for n in measured}
        actions.append(session.step(x, ahead[-1], t=t, p=p))
        checked.append(np.nan)
        if check_of is not None and actions[-1].status is not CycleStatus.BAD_INPUT:
            checked[-1] = check_of.residual(session.plan, session.data(ahead[-1], t, p, None))
        run.step(actions[-1].controls)
        signals.append(run.signals)
    columns = {name: np.array([getattr(a, name) for a in actions]) for name in FROM_ACTIONS}
    return ClosedLoopRun(
        plant=plant.name,
        controller=design.name,
        t=h.step * np.arange(float(len(actions))),
        t_end=h.step * len(actions),
        signals={n: np.array([row[n] for row in signals]) for n in signals[0] if n not in driven},
        units=dict(plant.signals) | {c.name: c.unit for c in design.controls},
        controls={n: np.array([a.controls[n] for a in actions]) for n in driven},
        references={n: np.array([float(row[n][0]) for row in ahead]) for n in references},
        checked=np.array(checked),
        status=np.array([int(a.status) for a in actions]),
        tolerance=design.settings.tolerance,
        **columns,
    )


def _values(reference: Reference, times: Array) -> Array:
    value = reference(times) if callable(reference) else reference
    return np.broadcast_to(np.asarray(value, dtype=float), times.shape)
