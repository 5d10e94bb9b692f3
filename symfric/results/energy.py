"""The balance of energy of a mechanism, its work by quadrature over the accepted steps."""

from dataclasses import dataclass
from typing import Any, final

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from symfric.foundation.shown import Showing, Shown, Table
from symfric.foundation.symbols import stacked
from symfric.model.kinds import WORK
from symfric.results.quadrature import integrals
from symfric.results.signals import Signals

Array = NDArray[np.float64]


@final
@dataclass(frozen=True, eq=False, repr=False)
class EnergyBalance(Showing):
    """Energy of a mechanism and the work that changed it, over the times of a trajectory.

        defect(t) = E(t) - E(0) - W(t),   W the sum of all work

    W is the integral of the powers over the dense output, which error control does not see, so
    that the defect shows the error of the simulation. It falls with the step as the method does,
    with order 5 (rodas5p, radau5), 4 (rodas4p) or 3 (rodas3), and is up to a hundred times larger
    inside the steps than at their ends. Energy that an event's reset takes at once is defect.

    Attributes:
        t: times [s], shape (n,).
        energy: kinetic and potential energy [J], without potentials that depend on time or inputs.
        work: name -> work done on the bodies [J]: by friction (negative), by each force that is
            not conservative, by prescribed motions.
        defect: what is left [J].
        scale: the largest kinetic energy, change of potential energy, or work [J].
    """

    t: Array
    energy: Array
    work: dict[str, Array]
    defect: Array
    scale: float

    def shown(self) -> Shown:
        """Energy at the start and at the end, the work in between, and what is left."""
        rows = [("energy at the start", f"{self.energy[0]:.6g}")]
        rows += [(f"work of {name}", f"{work[-1]:.6g}") for name, work in self.work.items()]
        rows += [("energy at the end", f"{self.energy[-1]:.6g}")]
        rows += [("unexplained, at most", f"{np.abs(self.defect).max():.3g}")]
        title = f"energy from {self.t[0]:g} to {self.t[-1]:g} s"
        after = f"unexplained over what moved: {self.relative:.2g}"
        return Shown(title, (), Table(("", "J"), tuple(rows), numbers=(1,)), (after,))

    @property
    def relative(self) -> float:
        """The largest defect over `scale`; 0 where nothing moved but rounding."""
        largest = float(np.abs(self.defect).max(initial=0.0))
        moved = self.scale > 1e-16 * float(np.abs(self.energy).max(initial=0.0))
        return largest / self.scale if moved else 0.0

    def to_dict(self) -> dict[str, Any]:
        """Numbers at the end [J], and the largest defect."""
        return {
            "start": float(self.energy[0]),
            "end": float(self.energy[-1]),
            "work": {name: float(work[-1]) for name, work in self.work.items()},
            "defect": float(np.abs(self.defect).max()),
            "relative": self.relative,
        }


def energy_balance(trajectory: Signals) -> EnergyBalance:
    """The balance of a model that has the detail "conserved" and powers of the kind `WORK`.

    Raises:
        ValueError: the model has no such details.
    """
    details = trajectory.details
    if "conserved" not in details:
        raise ValueError(
            f"trajectory of '{trajectory.scene}': expected a mechanism, got a model that says "
            "nothing of its energy; integral(name) integrates any of its signals"
        )
    start = trajectory.step_times[:1]
    model, at = trajectory.model, np.concatenate([start, trajectory.t])
    powers = [name for name, output in trajectory.model.further.items() if output.kind == WORK]
    rates = {name.removesuffix("_work_rate"): name for name in powers}
    column = stacked(model.expression(name) for name in rates.values())
    energy, kinetic = trajectory.of(
        ca.vertcat(model.expression("conserved"), model.expression("kinetic")), at
    )
    rows = integrals(trajectory, column, trajectory.t) if rates else np.zeros((0, 0))
    work = dict(zip(rates, rows, strict=True))
    gained = energy - energy[0]
    potential = energy - kinetic
    sizes = [kinetic, potential - potential[0], *work.values()]
    return EnergyBalance(
        trajectory.t,
        energy[1:],
        work,
        gained[1:] - sum(work.values(), np.zeros(trajectory.t.size)),
        max(float(np.abs(size).max()) for size in sizes),
    )
