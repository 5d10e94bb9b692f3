"""Jitter of accelerations: total variation over law, step size and transition velocity.

    TV = sum |a(t_k+1) - a(t_k)|,   t_k every millisecond

The mechanism is the four-mass system over 4 s. The source of `SelfTuning` reports that one law
jitters and the other does not. At equal velocity of the peak of friction, both have the same
variation if the step resolves the transition, and both jitter if a fixed explicit step does not
resolve it, h mu'(0) N / m > 2.8.
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from functools import partial
from typing import final

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from symfric.bench.report import Found, Progress, Report, curves
from symfric.integrator.equations.blocks import corrected
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
"""Step sizes of the explicit method [ms]."""
RTOL = 1e-9
SIGNALS = ("x1", "x4")
SLIDERS = tuple(f"TV of {s}'' [m/s^2]" for s in SIGNALS)
T_END = 4.0
TITLE = "Total variation of the accelerations of sliders 1 and 4 of the four-mass system"


def bench(
    quick: bool = False,
    scales: Sequence[float] = SCALES,
    fixed_ms: Sequence[float] = FIXED_MS,
    rtol: float = RTOL,
    t_end: float = T_END,
    progress: Progress = None,
) -> Report:
    """Measure both laws at all velocities, with error control and with fixed steps.

    Variations are NaN if a run is not finite.

    Args:
        quick: every other velocity.
        scales: velocities of the peak of friction [m/s].
        fixed_ms: steps of RK4 [ms], which divide 1 ms or are multiples of it.
        rtol: relative tolerance of Rodas5P with error control.
        t_end: end time [s].
        progress: called with the current item and the fraction done.
    """
    tasks = {
        f"{name}, {v_t:g} m/s": partial(_rows, name, v_t, fixed_ms, rtol, t_end)
        for name in LAWS
        for v_t in (scales[1::2] if quick else scales)
    }
    draw = curves("law", ("step control",), "v_t [m/s]", *SLIDERS)
    return Report((TITLE, draw)).collect(tasks, progress)


def _rows(
    name: str, v_t: float, fixed_ms: Sequence[float], rtol: float, t_end: float
) -> Iterator[Found]:
    runs = _Runs(FourMass(LAWS[name](v_t)).model(), t_end)
    rk4, rodas = runge_kutta_4(runs.whole), build_fixed(runs.whole, METHODS["rodas5p"])
    methods = {f"rtol = {rtol:g}": partial(runs.adaptive, rtol)}
    methods |= {f"RK4, h = {h:g} ms": partial(runs.fixed, rk4, h * 1e-3) for h in fixed_ms}
    methods["Rodas5P, h = 1 ms"] = partial(runs.fixed, rodas, 1e-3)
    for method, run in methods.items():
        variations = zip(SLIDERS, run(), strict=True)
        yield TITLE, {"law": name, "step control": method, "v_t [m/s]": v_t, **dict(variations)}


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

    def adaptive(self, rtol: float) -> list[float]:
        """Run with error control."""
        run = simulate(self.model, self.t_end, rtol=rtol, t_eval=self.times)
        return [variation(run[f"{s}_a"]) for s in SIGNALS]

    def fixed(self, step: ca.Function, h: float) -> list[float]:
        """Run `step` at the fixed step size `h` [s]."""
        count = round(self.t_end / h)
        d = np.zeros((self.whole.d.numel(), count))
        y = step.mapaccum("run", count)(self.y0, np.full((1, count), h), d).full()
        every = max(1, round(1e-3 / h))
        samples = np.hstack([self.y0[:, None], y[:, every - 1 :: every]])
        accelerations = corrected(self.whole).map(samples.shape[1])(samples, 0).full()
        offset = self.whole.nx - len(self.model.x) // 2
        return [variation(accelerations[offset + i]) for i in self.rows]


def runge_kutta_4(whole: System) -> ca.Function:
    """Return the step (y, h, d) -> y_next of the classical method, on the constraints at each
    stage.
    """
    y, h, d = ca.SX.sym("y", whole.n), ca.SX.sym("h"), ca.SX.sym("d", whole.d.numel())
    refine, f = corrected(whole), ca.Function("f", [whole.y, whole.d], [whole.f])
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
    """Return the total variation of samples; NaN if they are not finite."""
    total = float(np.abs(np.diff(a)).sum())
    return total if np.isfinite(total) else float("nan")
