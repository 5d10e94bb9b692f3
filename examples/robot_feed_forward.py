"""Feed-forward control in C of a six-axis arm with friction and load along a planned path.

    tau = inverse dynamics(q, qd, qdd of the plan) + 300 (q_plan - q) + 10 (qd_plan - qd), scaled

`inverse_dynamics_block` writes the forces of a motion as one C function; the mass of the load and
the coefficients of friction are in its parameter struct. The generated loader runs the C of the
robot, which computes the feed-forward for the simulated arm; the friction of its bearings depends
on their loads. Runs with other parameters show the effect of each term.

    python examples/robot_feed_forward.py [OUT]
"""

import sys
from importlib import import_module
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from symfric import BrownMcPhee, stepper
from symfric.codegen import generate, inverse_dynamics_block, verify
from symfric.foundation.panels import panels, save
from symfric.foundation.style import line
from symfric.scenes import Arm

Array = NDArray[np.float64]
H, T, LOAD, JOINTS = 1e-3, 1.6, 2.0, 6
MOVE = np.array([0.8, -0.5, 0.7, -1.2, 0.9, 1.5])
STIFF, DAMP = 300.0, 10.0
SHARE = np.array([1.0, 1.0, 0.6, 0.1, 0.05, 0.01])
"""Factors of stiffness and damping of the joints, similar to their inertias."""

CARRIED: dict[str, Any] = {"payload_m": LOAD, "payload_c": [0.04, 0.0, 0.0]}
SMOOTH: dict[str, Any] = {"mu_s": [0.0] * JOINTS, "mu_d": [1e-12] * JOINTS}
CASES = {
    "no feed-forward": {},
    "rigid bodies": SMOOTH,
    "and the load": SMOOTH | CARRIED,
    "and friction": CARRIED,
}


def plan(start: Array) -> tuple[Array, Array, Array]:
    """Return q, qd and qdd by polynomials of fifth order, shape (samples, joints) each."""
    s = np.arange(0.0, T, H) / (T / 2)
    s, way = np.minimum(s, 2 - s), np.where(s <= 1, 1.0, -1.0)
    shape = s**3 * (10 - 15 * s + 6 * s * s)
    rate = way * 30 * s**2 * (1 - s) ** 2 / (T / 2)
    bend = 60 * s * (1 - s) * (1 - 2 * s) / (T / 2) ** 2
    return start + np.outer(shape, MOVE), np.outer(rate, MOVE), np.outer(bend, MOVE)


def feed_forward(kit: Any, numbers: dict[str, Any], motion: tuple[Array, Array, Array]) -> Array:
    """Return torques of the C for the plan, shape (samples, joints)."""
    if not numbers:
        return np.zeros_like(motion[0])
    inputs = {
        f"{name}_{k + 1}": values[:, k]
        for name, values in zip(("q", "qd", "qdd"), motion, strict=True)
        for k in range(JOINTS)
    }
    torque = kit.Block("float", **numbers).run(**inputs)
    return np.column_stack([torque[f"tau_{k}"] for k in range(1, JOINTS + 1)])


def main(out: Path) -> None:
    """Write the C, simulate the arm in all cases as a batch, and show the errors."""
    arm = Arm(BrownMcPhee(), load=LOAD)
    block = inverse_dynamics_block(Arm(BrownMcPhee()).mechanism(), payload="link6")
    made = generate(block, out / "c", real=("double", "float"))
    print(f"C: {verify(made).status}")
    sys.path.insert(0, str(out / "c"))
    kit = import_module("arm_ctypes")

    model = arm.model()
    start = np.array([float(v.start) for v in model.x[:JOINTS]])
    q, qd, qdd = plan(start)
    ahead = np.stack([feed_forward(kit, own, (q, qd, qdd)) for own in CASES.values()], axis=1)
    plant = stepper(model, H, batch=len(CASES))
    x, errors = plant.reset(), list[Array]()
    for k in range(len(q)):
        error = q[k] - x[:, :JOINTS]
        errors.append(error)
        back = STIFF * error + DAMP * (qd[k] - x[:, JOINTS : 2 * JOINTS])
        x = plant.step(ahead[k] + SHARE * back)
    t, off = H * np.arange(len(q)), 1e3 * np.linalg.norm(np.array(errors), axis=2)
    figure, (axes,) = panels(1, height=2.8)
    for i, name in enumerate(CASES):
        print(f"{name}: {np.sqrt(np.mean(off[:, i] ** 2)):.3f} mrad rms")
        axes.semilogy(t, off[:, i], label=name, **line(i))
    axes.set(xlabel="t [s]", ylabel="error of all joints [mrad]", ylim=(1e-3, None))
    axes.legend()
    save(figure, out / "robot_feed_forward.png")


if __name__ == "__main__":
    main(Path(sys.argv[1] if len(sys.argv) > 1 else "out"))
