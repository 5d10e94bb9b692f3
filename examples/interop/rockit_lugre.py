"""The move of `opti_lugre` in rockit: `set_next` takes `flow`, `set_der` a right-hand side.

    min  sum of u_k^2 h,   0.1 m in 1 s from rest to rest,   |u| <= 20 N

With `set_der` rockit transcribes the bristles by collocation; with `set_next` the plant is the
implicit step of symfric. Needs rockit (pip install rockit-meco).
"""

import casadi as ca
import numpy as np
import rockit  # pyright: ignore[reportMissingImports]

from symfric import Hold, LuGre, drive, flow, simulate

GOAL, T, N = 0.1, 1.0, 50


def main() -> None:
    """Solve in both ways and verify."""
    model = drive(LuGre(), m=1.0, N=10.0)
    for way in ("set_next", "set_der"):
        ocp = rockit.Ocp(T=T)
        x, u = ocp.state(len(model.x)), ocp.control()
        if way == "set_next":
            ocp.set_next(x, flow(model, steps=10)(x, u, [], T / N))
            ocp.method(rockit.MultipleShooting(N=N))
            ocp.add_objective(ocp.sum(u**2) * T / N)
        else:
            f = ca.Function("f", [model.vector("x"), model.vector("u")], [model.ode])  # pyright: ignore
            ocp.set_der(x, f(x, u))
            ocp.method(rockit.DirectCollocation(N=N, degree=3))
            ocp.add_objective(ocp.integral(u**2))
        ocp.subject_to(ocp.at_t0(x) == 0)
        ocp.subject_to(ocp.at_tf(x)[:2] == ca.DM([GOAL, 0.0]))
        ocp.subject_to(-20.0 <= (u <= 20.0))  # noqa: SIM300  (how rockit writes it)
        sliding = float(ca.DM(LuGre().steady_state(GOAL / T, 10.0)))
        ocp.set_initial(x, ca.DM([GOAL / 2, GOAL / T, sliding]))
        ocp.solver("ipopt", {"print_time": False, "ipopt.print_level": 0, "ipopt.sb": "yes"})
        controls = ocp.solve().sample(u, grid="control")[1][:N]

        held = Hold(np.linspace(0.0, T, N + 1)[:-1], controls)
        run = simulate(model, T, u={"force": held}, x0={"x": 0.0, "v": 0.0, "z": 0.0})
        miss = 1e6 * (run.final["x"] - GOAL)
        print(f"{way}: J = {np.sum(controls**2) * T / N:.4f} N^2 s, simulated {miss:+.1f} um")


if __name__ == "__main__":
    main()
