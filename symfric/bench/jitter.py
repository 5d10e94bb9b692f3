"""Does an acceleration jitter: its total variation against law, step and transition velocity.

    TV = sum |a(t_k+1) - a(t_k)|,   t_k every millisecond

Of the four-mass system over 4 s. The source of `SelfTuning` reports that one law jitters where the
other does not. At equal velocity of the peak both have the same variation wherever the step
resolves the transition, and where a fixed explicit step does not, h mu'(0) N / m > 2.8, both
jitter.
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Any, final

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from symfric.bench import table
from symfric.figures import FigureData
from symfric.figures.data import Curve
from symfric.integrator.equations.blocks import refinement
from symfric.integrator.equations.initial import consistent, first_guess
from symfric.integrator.equations.inputs import input_data
from symfric.integrator.equations.system import System, system
from symfric.integrator.methods.tableaux import METHODS
from symfric.integrator.simulate import simulate
from symfric.integrator.step.attempt import build_fixed
from symfric.laws import BrownMcPhee, Law, SelfTuning
from symfric.model import Model, Output
from symfric.scenes import FourMass

Array = NDArray[np.float64]
SCALES = (0.02, 0.01, 0.005, 0.002, 0.001, 0.0005)
"""Velocities of the peak of friction [m/s]."""
LAWS: dict[str, Callable[[float], Law]] = {
    "brown_mcphee": lambda v: BrownMcPhee(mu_s=0.12, mu_d=0.1, v_t=v),
    "self_tuning": lambda v: SelfTuning.from_peak_velocity(v, mu_s=0.12, mu_d=0.1),
}
FIXED_MS = (2.0, 1.0, 0.25)
"""Fixed steps [ms]."""
TOLERANCES = (1e-9,)
SIGNALS = ("x1", "x4")
T_END = 4.0


def jitter(
    scales: Sequence[float] = SCALES,
    fixed_ms: Sequence[float] = FIXED_MS,
    tolerances: Sequence[float] = TOLERANCES,
    t_end: float = T_END,
    progress: table.Progress = None,
) -> FigureData:
    """Total variation of the accelerations of sliders 1 and 4.

    Columns v_t [m/s], TV of x1'' and TV of x4'' [m/s^2]; NaN where a run leaves all bounds. A curve
    for each law and each of: rtol (adaptive Rodas5P), Runge-Kutta of order 4 and Rodas5P with fixed
    steps, which divide 1 ms or are multiples of it.
    """
    curves: list[Curve] = []
    for number, (name, law) in enumerate(LAWS.items()):
        found: dict[str, list[tuple[float, ...]]] = {}
        for k, v_t in enumerate(scales):
            if progress is not None:
                progress(name, (number + k / len(scales)) / len(LAWS))
            runs = _Runs(FourMass(law(v_t)).model(), t_end)
            for rtol in tolerances:
                found.setdefault(f"rtol = {rtol:g}", []).append(runs.adaptive(rtol))
            for ms in fixed_ms:
                found.setdefault(f"RK4, h = {ms:g} ms", []).append(runs.explicit(ms * 1e-3))
            found.setdefault("Rodas5P, h = 1 ms", []).append(runs.implicit(1e-3))
        for case, values in found.items():
            table = np.array(values).T
            columns = {"v_t": np.array(scales)}
            columns |= {f"TV of {s}''": row for s, row in zip(SIGNALS, table, strict=True)}
            curves.append(Curve(name, case, columns))
    units = {"v_t": "m/s"} | {f"TV of {s}''": "m/s^2" for s in SIGNALS}
    return FigureData(
        "jitter",
        f"total variation of accelerations, four-mass system, {t_end:g} s",
        units,
        tuple(("v_t", f"TV of {s}''") for s in SIGNALS),
        tuple(curves),
        log=tuple(units),
        dots=True,
    )


@final
@dataclass(frozen=True, eq=False)
class JitterBenchmark(table.Report):
    """Total variations of accelerations, see `jitter`."""

    data: FigureData

    def to_dict(self) -> dict[str, Any]:
        """The figure as plain data."""
        return self.data.to_dict()

    def shown(self) -> Iterator[table.Table | str]:
        """A line for each law, way of stepping and velocity."""
        units = self.data.units
        rows = [
            [c.law, c.case, *(table.short(float(c[name][k])) for name in units)]
            for c in self.data.curves
            for k in range(c[next(iter(units))].size)
        ]
        head = ["law", "step control", *(f"{name} [{unit}]" for name, unit in units.items())]
        yield table.Table(self.data.title, head, rows)

    def drawn(self) -> tuple[Any, ...]:
        """A panel per slider, a colour per way of stepping, the laws by line and marker."""
        return "jitter", self.data


def bench_jitter(*, quick: bool = False, progress: table.Progress = None) -> JitterBenchmark:
    """Measure both laws at all velocities; `quick`: at every other one."""
    return JitterBenchmark(jitter(SCALES[1::2] if quick else SCALES, progress=progress))


@final
class _Runs:
    """Runs of one model, each as the total variations of its accelerations."""

    def __init__(self, model: Model, t_end: float) -> None:
        mechanics = model.holonomic
        if mechanics is None or model.ode is None:
            raise ValueError(f"jitter: expected a mechanism, got the model '{model.name}'")
        names = [v.name for v in model.x]
        self.rows = [mechanics.n + names.index(s) for s in SIGNALS]
        outputs = {
            f"{s}_a": Output(model.ode[i], "m/s^2") for s, i in zip(SIGNALS, self.rows, strict=True)
        }
        self.model, self.t_end = replace(model, outputs=outputs), t_end
        self.times = np.linspace(0.0, t_end, round(t_end * 1e3) + 1)
        self.whole = system(model, input_data(model, None, 0.0, t_end))
        y = first_guess(self.whole, model, model.initial_state())
        self.y0 = consistent(self.whole, "jitter", y, np.zeros(0))

    def adaptive(self, rtol: float) -> tuple[float, ...]:
        """Total variation of the accelerations of a run with error control."""
        run = simulate(self.model, self.t_end, rtol=rtol, t_eval=self.times)
        return tuple(variation(run[f"{s}_a"]) for s in SIGNALS)

    def explicit(self, h: float) -> tuple[float, ...]:
        """Runge-Kutta of order 4, constraints restored after every stage."""
        return self._fixed(runge_kutta_4(self.whole), h)

    def implicit(self, h: float) -> tuple[float, ...]:
        """Rodas5P without error control."""
        return self._fixed(build_fixed(self.whole, METHODS["rodas5p"]), h)

    def _fixed(self, step: ca.Function, h: float) -> tuple[float, ...]:
        count = round(self.t_end / h)
        d = np.zeros((self.whole.d.numel(), count))
        y = step.mapaccum("run", count)(self.y0, np.full((1, count), h), d).full()
        every = max(1, round(1e-3 / h))
        samples = np.hstack([self.y0[:, None], y[:, every - 1 :: every]])
        accelerations = refinement(self.whole).map(samples.shape[1])(samples, 0).full()
        offset = self.whole.nx - len(self.model.x) // 2
        return tuple(variation(accelerations[offset + i]) for i in self.rows)


def runge_kutta_4(whole: System) -> ca.Function:
    """The step (y, h, d) -> y_next of the classical method, on the constraints at every stage."""
    y, h, d = ca.SX.sym("y", whole.n), ca.SX.sym("h"), ca.SX.sym("d", whole.d.numel())
    refine, f = refinement(whole), ca.Function("f", [whole.y, whole.d], [whole.f])
    nx = whole.nx

    def at(k: ca.SX, part: float) -> ca.SX:
        return refine(ca.vertcat(y[:nx] + part * h * k, y[nx:]), d)

    k1 = f(y, d)[:nx]
    k2 = f(at(k1, 0.5), d)[:nx]
    k3 = f(at(k2, 0.5), d)[:nx]
    k4 = f(at(k3, 1.0), d)[:nx]
    end = at((k1 + 2 * k2 + 2 * k3 + k4) / 6, 1.0)
    return ca.Function("rk4", [y, h, d], [end], {"cse": True})


def variation(a: Array) -> float:
    """Total variation of samples; NaN where they are not finite."""
    total = float(np.abs(np.diff(a)).sum())
    return total if np.isfinite(total) else float("nan")
