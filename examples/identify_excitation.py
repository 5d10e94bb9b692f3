"""The most informative motion of a drive about its friction, within limits.

    maximise  log det I(T)   subject to   |force| <= 20 N, |x| <= 0.1 m, |v| <= 1 m/s, 2 s

I is the Fisher information about the mass and three parameters of Stribeck friction in positions
with 0.1 mm of noise, sampled every 10 ms. In this optimal control problem, `informative` adds the
sensitivities and I to the states. The result is compared with the best sine within the same limits,
and is simulated; the printed miss is the difference of the simulation. The optimum is local: other
initial sines lead to other optima.

    python examples/identify_excitation.py [OUT]
"""

import sys
from functools import partial
from pathlib import Path

import numpy as np
from rich.console import Console
from rich.table import Table

from identification import expected_errors, informative
from ocp import Ipopt, Phase, Problem, Solution, at_end, solve
from symfric import Stribeck, drive, simulate
from symfric.integrator import Linear, Trajectory
from symfric.model import Model

FREE = ("m", "mu_s", "mu_d", "sigma_2")
T, FORCE, X, V = 2.0, 20.0, 0.1, 1.0
TIMES = np.linspace(0.0, T, 401)


def machine() -> Model:
    """The drive with assumed parameters, and the information as a state."""
    friction = Stribeck(mu_s=6.0, mu_d=4.0, v_s=0.1, v_eps=0.05, sigma_2=8.0)
    model = drive(friction, m=2.0, N=1.0, free=FREE)
    return informative(model, FREE, {"x": 1e-4}, step=1e-2, aim=1.5e-3)


def best_sine(model: Model) -> Trajectory:
    """Return the most informative sine within the limits."""
    found: list[Trajectory] = []
    for w in 2 * np.pi * np.arange(0.5, 4.1, 0.5):
        for size in np.linspace(0.25, 1.0, 7) * FORCE:
            sine = Linear(TIMES, size * np.cos(w * TIMES))
            found.append(simulate(model, T, u={"force": sine}, t_eval=TIMES))
    inside = [m for m in found if np.abs(m["x"]).max() <= X and np.abs(m["v"]).max() <= V]
    return max(inside, key=lambda motion: motion["information"][-1])


def best_motion(model: Model, guess: Trajectory) -> Solution:
    """Return the motion with the largest information, starting from a sine."""
    problem = Problem(
        Phase(model, T=T),
        -at_end(lambda s: s.information),
        bounds={"force": (-FORCE, FORCE), "x": (-X, X), "v": (-V, V)},
        rates={"force": (-400.0, 400.0)},
    )
    guided = {v.name: guess[v.name] for v in (*model.x, *model.u)}
    rough, fine = (partial(solve, problem, friction="smooth", refine=False, tolerance=0.01,
                           intervals=n, solver=Ipopt(tol=1e-4, acceptable_tol=1e-3))
                   for n in (60, 120))  # fmt: skip
    return fine(guess=rough(guess=guided, throw=False))


def main(out: Path) -> None:
    """Print the expected errors of both motions, and draw the optimised one."""
    model = machine()
    sine = best_sine(model)
    motion = best_motion(model, sine)
    table = Table("relative standard errors [%]", *FREE, "log det I / 4")
    for name, signals in (("best sine", sine), ("optimised", motion.signals)):
        errors = expected_errors(FREE, signals)
        cells = [f"{100 * errors[p]:.3f}" for p in FREE]
        table.add_row(name, *cells, f"{signals['information'][-1]:.2f}")
    Console().print(table, motion.status.name, f"miss {motion.miss:.1e}")
    motion.plot("x", "v", "force", "information", path=out / "excitation.png")


if __name__ == "__main__":
    main(Path(sys.argv[1] if len(sys.argv) > 1 else "out"))
