"""Position a drive with friction by model predictive control, and write the controller as C.

    m v' = force - F(v),   m = 1 kg,   |force| <= 20 N,   F: 6 N to break away, 4 N while sliding

Every 10 ms the states are measured, the motion of the next 0.2 s is optimised, and its first force
is applied. The model of the controller has friction that is smooth over 1 cm/s. The plants have
different friction: a hundred times sharper, bristles, or the set-valued law of Coulomb.

    python examples/mpc_drive.py [OUT]
"""

import sys
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from rich.console import Console
from rich.table import Table

from ocp import ClosedLoopRun, Controller, Phase, Problem, at_end, effort, plot_loops, track
from symfric import BrownMcPhee, ExactCoulomb, Law, LuGre, drive
from symfric.model import Model

Array = NDArray[np.float64]


def rubbing(law: Law) -> Model:
    """Return a mass of 1 kg; with N = 1 N the coefficients of the law are in newtons."""
    return drive(law, m=1.0, N=1.0)


def controller() -> Controller:
    """Return a controller with 20 intervals of 10 ms and the parameter "goal"."""
    cost = track("x", "goal", 900.0) + track("v", 0.0, 1.0) + effort("force", 1e-3)
    cost += at_end(lambda s: 100 * (s.x - s.goal) ** 2 + s.v**2)
    model = rubbing(BrownMcPhee(mu_s=6.0, mu_d=4.0, v_t=1e-2))
    bounds = {"force": (-20.0, 20.0)}
    return Problem(Phase(model, T=0.2), cost, bounds=bounds, p={"goal": 0.0}).to_mpc(0.01)


def plants() -> dict[str, Model]:
    """Return the real plants."""
    bristles = LuGre(mu_s=6.0, mu_d=4.0, v_s=1e-2, sigma_0=1e5, sigma_1=300.0, sigma_2=0.0)
    return {
        "sharp": rubbing(BrownMcPhee(mu_s=6.0, mu_d=4.0, v_t=1e-4)),
        "bristles": rubbing(bristles),
        "Coulomb": rubbing(ExactCoulomb(mu_s=6.0, mu_d=4.0)),
    }


def goal(t: Array) -> Array:
    """Return 10 cm and 0 in turn, each for 1 s."""
    return np.where(np.mod(t, 2.0) < 1.0, 0.1, 0.0)


def table(loops: dict[str, ClosedLoopRun]) -> Table:
    """Return a row for each plant, with errors in the middle between changes of the goal."""
    result = Table("plant", "error", "median [ms]", "worst [ms]", "not converged", "unreported")
    for name, loop in loops.items():
        k = np.flatnonzero(np.isclose(np.mod(loop.t, 1.0), 0.5))
        error = float(np.abs(loop["x"][k] - goal(loop.t[k])).max())
        result.add_row(
            name,
            f"{1e3 * error:.2f} mm",
            f"{1e3 * loop.median:.3f}",
            f"{1e3 * loop.worst_cpu:.3f}",
            f"{loop.unconverged} of {loop.t.size}",
            str(loop.unreported),
        )
    return result


def main(out: Path) -> None:
    """Close the loops, print, and write C, data and a picture into `out`."""
    made = controller()
    loops = {
        name: made.simulate(plant, 4.0, {"goal": goal}, noise={"x": 1e-5, "v": 1e-3})
        for name, plant in plants().items()
    }
    check = made.to_c(out / "c").verify()
    Console().print(table(loops))
    print(f"C: {check.status}, {check.bytes} bytes of memory")
    plot_loops(loops, ["x", "v", "force"], out / "mpc_drive.png")
    loops["Coulomb"].to_csv(out / "mpc_drive.csv")


if __name__ == "__main__":
    main(Path(sys.argv[1] if len(sys.argv) > 1 else "out"))
