"""An Opti script with LuGre: `flow` is the discrete plant.

    min  sum of u_k^2 h,   0.1 m in 1 s from rest to rest,   |u| <= 20 N

Bristles of 10 um are stiff: a transcription of the equations would have to resolve them. `flow`
takes ten implicit steps in every interval, with exact derivatives of any order. A simulation with
error control verifies the result.
"""

import sys
from pathlib import Path

import casadi as ca
import numpy as np

from symfric import Hold, LuGre, drive, flow, simulate

GOAL, T, N = 0.1, 1.0, 50


def main(folder: Path) -> None:
    """Solve and verify."""
    model = drive(LuGre(), m=1.0, N=10.0)  # states x, v and the bristle z; input force
    advance = flow(model, steps=10)  # (x, u, p, h) -> x after h

    opti = ca.Opti()
    x, u = opti.variable(len(model.x), N + 1), opti.variable(1, N)
    opti.subject_to(x[:, 0] == 0)
    for k in range(N):
        opti.subject_to(x[:, k + 1] == advance(x[:, k], u[:, k], [], T / N))
    opti.subject_to(x[:2, N] == ca.DM([GOAL, 0.0]))
    opti.subject_to(opti.bounded(-20.0, ca.vec(u), 20.0))
    opti.minimize(ca.sumsqr(u) * T / N)
    sliding = LuGre().steady_state(GOAL / T, 10.0)  # a good first guess of the bristle
    opti.set_initial(x, np.tile([[GOAL / 2], [GOAL / T], [float(ca.DM(sliding))]], N + 1))
    opti.solver("ipopt", {"print_time": False, "ipopt.print_level": 0, "ipopt.sb": "yes"})
    found = opti.solve()

    held = Hold(np.linspace(0.0, T, N + 1)[:-1], np.ravel(found.value(u)))
    run = simulate(model, T, u={"force": held}, x0={"x": 0.0, "v": 0.0, "z": 0.0})
    print(f"{opti.stats()['iter_count']} iterations, J = {found.value(opti.f):.4f} N^2 s")
    print(f"simulated: {1e6 * (run.final['x'] - GOAL):+.1f} um, {1e6 * run.final['v']:+.1f} um/s")
    folder.mkdir(parents=True, exist_ok=True)
    run.plot("x", "v", "force", "friction", path=folder / "opti_lugre.png")


if __name__ == "__main__":
    main(Path(sys.argv[1] if len(sys.argv) > 1 else "out"))
