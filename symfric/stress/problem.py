"""What the data of a case mean: its model, its inputs, and one call of `simulate`."""

import warnings
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any, final

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from symfric.foundation.parameters import parameters, with_values
from symfric.integrator import Hold, Input, Linear, simulate
from symfric.laws import law_from_text
from symfric.model import Model
from symfric.results.trajectory import Trajectory
from symfric.scenes import ALL_SCENES
from symfric.stress.cases import Case, Signal

Array = NDArray[np.float64]
WORK = 120_000
TIMES = 101
"""Times at which runs are compared."""


@final
@dataclass(frozen=True, eq=False)
class Problem:
    """A case made ready to run.

    Attributes:
        model: the equations.
        inputs: as `simulate` takes them.
        p: parameters given at run time.
        work: attempts that a run may take, times its unknowns: large machines have fewer, of which
            each costs more.
    """

    case: Case
    model: Model
    inputs: Mapping[str, Input]
    p: Mapping[str, float]
    work: int = WORK

    @property
    def attempts(self) -> int:
        """Attempts that a run may take."""
        return self.work // (len(self.model.x) + len(self.model.z))

    @property
    def times(self) -> NDArray[np.float64]:
        """Where runs are compared [s]."""
        return np.linspace(self.case.t_start, self.case.t_end, TIMES)

    def run(
        self,
        rtol: float,
        method: str,
        *,
        max_steps: int,
        backend: str = "vm",
        x0: Mapping[str, float] | None = None,
        t_eval: NDArray[np.float64] | None = None,
        **options: Any,
    ) -> Trajectory:
        """One simulation; raises what `simulate` raises. Warnings are for users, not for judges."""
        times = self.times if t_eval is None else t_eval
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", UserWarning)
            return simulate(
                self.model,
                self.case.t_end,
                t_start=float(times[0]),
                t_eval=times,
                x0=self.case.x0 if x0 is None else x0,
                u=self.inputs,
                p=self.p,
                rtol=rtol,
                method=method,
                backend=backend,
                max_steps=max_steps,
                **options,
            )


def problem(case: Case, work: int = WORK) -> Problem:
    """Build the model of a case.

    Raises:
        ValueError: numbers that the law, the scene or the equations refuse.
    """
    law = law_from_text(case.law)
    law = replace(law, **case.forms) if case.forms else law
    scene = with_values(ALL_SCENES[case.scene](law), case.values)
    p = {name: case.values[name] for name in case.free}
    if p:  # the model starts at the defaults, and the numbers come at run time
        known = parameters(ALL_SCENES[case.scene](law))
        scene = with_values(scene, {name: known[name].value for name in p})
    inputs = {name: signal(s) for name, s in case.inputs.items()}
    return Problem(case, scene.model(free=case.free), inputs, p, work)


def signal(s: Signal) -> Input:
    """An input as `simulate` takes it.

    Raises:
        ValueError: a kind that there is not, or another count of values.
    """
    if s.kind in ("hold", "linear"):
        return (Hold if s.kind == "hold" else Linear)(s.t, s.values)
    if s.kind == "constant":
        (c,) = s.values
        return c
    a, b, c = s.values
    if s.kind == "sine":
        return lambda t: a * ca.sin(b * t) + c
    if s.kind == "pulse":  # rises and falls within a tenth of its width
        return lambda t: a / 2 * (ca.tanh(20 * (t - b) / c) - ca.tanh(20 * (t - b - c) / c))
    raise ValueError(
        f"case: expected a signal constant, hold, linear, sine or pulse, got {s.kind!r}"
    )
