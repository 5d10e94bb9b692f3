"""A controller in do-mpc that plans with a smooth law; the plant is symfric's stepper.

    min  sum of 1e4 (x - r)^2 + u^2 over 25 steps of 20 ms,   |u| <= 20 N

The plan needs friction that is smooth on the scale of its steps; plans with bristles at rest do not
converge. The plant has bristles, 20 % more friction, and adaptive steps under a held input. Needs
do-mpc (pip install do-mpc).
"""

import warnings
from typing import Any

import numpy as np

from symfric import BrownMcPhee, ElastoPlastic, drive, flow, stepper

with warnings.catch_warnings():
    warnings.simplefilter("ignore")  # it tells at once of all extras that are not installed
    import do_mpc  # pyright: ignore[reportMissingImports]

H, GOAL = 0.02, 0.1


def controller() -> Any:
    """Return a controller of do-mpc; its right-hand side is a call of `flow`."""
    believed = drive(BrownMcPhee(v_t=5e-3), m=1.0, N=10.0)
    model = do_mpc.model.Model("discrete", "MX")
    x = model.set_variable("_x", "x", (len(believed.x), 1))
    u = model.set_variable("_u", "force")
    model.set_rhs("x", flow(believed, steps=10)(x, u, [], H))
    model.setup()
    mpc = do_mpc.controller.MPC(model)
    mpc.settings.n_horizon, mpc.settings.t_step = 25, H
    mpc.settings.supress_ipopt_output()
    mpc.set_objective(mterm=1e4 * (x[0] - GOAL) ** 2, lterm=1e4 * (x[0] - GOAL) ** 2)
    mpc.set_rterm(force=1e-3)
    mpc.bounds["lower", "_u", "force"], mpc.bounds["upper", "_u", "force"] = -20.0, 20.0
    mpc.setup()
    mpc.x0 = np.zeros((len(believed.x), 1))
    mpc.set_initial_guess()
    return mpc


def main() -> None:
    """Simulate one second in closed loop."""
    mpc = controller()
    plant = stepper(drive(ElastoPlastic(mu_s=0.18, mu_d=0.12), m=1.0, N=10.0), dt=H)
    for _ in range(50):
        force = float(mpc.make_step(np.array(plant.x[:2])[:, None])[0, 0])
        plant.step(force)
    print(f"after {plant.t:.1f} s: {1e3 * (plant.x[0] - GOAL):+.3f} mm from the goal,", end=" ")
    print(f"{1e3 * plant.x[1]:+.3f} mm/s")


if __name__ == "__main__":
    main()
