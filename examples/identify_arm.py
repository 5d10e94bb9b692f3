"""Friction in the joints of an arm under gravity, from angles and torques of two recorded motions.

Each joint has its own law, and its bearing carries the reactions of all links beyond it, so the
normal force of the shoulder depends on the motion of the elbow. Reactions are not measured. The
balance of forces with friction is solved for them at every sample. The fit minimises the residual
torques over coefficients of friction, viscosities and the payload.

The records are simulated with servos as springs and dampers, with noise of 1e-5 rad and 0.05 N m.

    python examples/identify_arm.py [OUT]
"""

import sys
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from identification import Dataset, Fit, InverseDynamics
from symfric import simulate
from symfric.foundation.numeric import cos, sin
from symfric.foundation.parameters import Variable
from symfric.laws import Coulomb, Sum, Viscous
from symfric.model import Model
from symfric.multibody import JointFriction, JointSpringDamper, Mechanism, Revolute

UP, SIDE = (0.0, 0.0, 1.0), (0.0, 1.0, 0.0)
JOINTS = {"base": UP, "shoulder": SIDE, "elbow": SIDE}
TRUE = {
    "payload": 1.2, "mu_base": 0.08, "mu_shoulder": 0.11, "mu_elbow": 0.14,
    "viscous_base": 40.0, "viscous_shoulder": 60.0, "viscous_elbow": 25.0,
}  # fmt: skip
UNITS = {"payload": "kg", "mu": "1", "viscous": "N s/m"}
STIFFNESS, DAMPING = 4000.0, 120.0  # N m/rad, N m s/rad of the servo


def arm(servo: bool) -> Model:
    """Return three links with a payload; torques are inputs, in addition to a servo or alone."""
    p = {n: Variable(n, UNITS[n.split("_")[0]], start=x, lower=0.0) for n, x in TRUE.items()}
    m = Mechanism("arm", gravity=(0.0, 0.0, -9.81))
    m.frame("ground.tip", at=(0.0, 0.0, 0.5), z=UP)
    before = "ground"
    for (name, axis), beyond in zip(JOINTS.items(), (SIDE, SIDE, None), strict=True):
        mass = 4.0 if beyond else 3.0 + p["payload"]
        m.body(name, mass, (0.01, 0.06, 0.06), com=(0.2 if beyond else 0.3, 0.0, 0.0))
        m.frame(f"{name}.root", z=axis)
        if beyond:
            m.frame(f"{name}.tip", at=(0.4 if name != "base" else 0.0, 0.0, 0.0), z=beyond)
        mu, viscous = p[f"mu_{name}"], p[f"viscous_{name}"]
        law = Sum((Coulomb(mu_d=mu, v_eps=2e-4), Viscous(sigma_2=viscous)))
        friction = JointFriction(law, radius=0.03, length=0.08)
        m.joint(Revolute(f"q_{name}", f"{before}.tip", f"{name}.root", 0.0, 0.0, friction))
        k, c = (STIFFNESS, DAMPING) if servo else (0.0, 0.0)
        torque = m.input(f"tau_{name}", "N m", nominal=10.0)
        m.force(JointSpringDamper(f"motor_{name}", f"q_{name}", "turn", k, 0.0, c, torque))
        before = name
    return m.build(tuple(p.values()))


def recorded(seed: int, duration: float = 6.0, rate: float = 400.0) -> Dataset:
    """Return noisy angles and torques of joints that follow sines."""
    rng = np.random.default_rng(seed)
    t = np.arange(round(duration * rate) + 1) / rate
    waves = {name: 2 * np.pi * rng.uniform(0.15, 0.6, 3) for name in JOINTS}

    def pull(t: Any, name: str) -> Any:
        """Return the torque [N m] that the servo adds to -STIFFNESS q - DAMPING q'."""
        return sum(
            size * (STIFFNESS * (1 - cos(w * t)) + DAMPING * w * sin(w * t))
            for w, size in zip(waves[name], (0.5, 0.3, 0.2), strict=True)
        )

    servo = {f"tau_{name}": partial(pull, name=name) for name in JOINTS}
    run = simulate(arm(servo=True), duration, u=servo, t_eval=t, rtol=1e-7)
    signals = dict[str, NDArray[np.float64]]()
    for name in JOINTS:
        angle, speed = run[f"q_{name}"], run[f"q_{name}_rate"]
        torque = pull(t, name) - STIFFNESS * angle - DAMPING * speed
        signals[f"q_{name}"] = angle + 1e-5 * rng.standard_normal(t.size)
        signals[f"tau_{name}"] = torque + 0.05 * rng.standard_normal(t.size)
    units = {n: "rad" if n.startswith("q") else "N m" for n in signals}
    return Dataset.of({"t": t, **signals}, units=units, name=f"motion {seed}")


def main(out: Path) -> None:
    """Fit two records from twice the true values, and print the values found."""
    start = {n: 2.0 * x for n, x in TRUE.items()}
    data = recorded(1) + recorded(2)
    found = Fit(InverseDynamics(), arm(servo=False), data, free=start).solve()
    print(found)
    for name, true in TRUE.items():
        print(f"{name}: {found.values[name]:.4g}, put in {true:g}")
    found.plot(out / "identify_arm.png")


if __name__ == "__main__":
    main(Path(sys.argv[1] if len(sys.argv) > 1 else "."))
