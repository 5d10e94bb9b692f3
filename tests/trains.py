"""Random trains of gears, worms, racks and screws with friction, and their moments by hand."""

from dataclasses import dataclass
from math import cos, pi, tan
from typing import Any

import numpy as np

from symfric import BrownMcPhee, Coulomb, ExactCoulomb, LuGreNormalised
from symfric import multibody as mb
from symfric.laws import Law

SMALL: dict[str, Any] = {"eps": 1e-9}


def some_law(k: int, mu: float) -> Law:
    """Return one of four laws whose dynamic level is mu."""
    if k == 0:
        return ExactCoulomb(mu_s=mu, mu_d=mu)
    if k == 1:
        return BrownMcPhee(mu_s=1.3 * mu, mu_d=mu, v_t=1e-3)
    return LuGreNormalised(mu_s=1.2 * mu, mu_d=mu) if k == 2 else Coulomb(mu_d=mu, v_eps=1e-3)


@dataclass(frozen=True)
class Stage:
    """An element with its ratio and friction, and the inertia or mass behind it."""

    ratio: float
    friction: Any
    inertia: float
    linear: bool

    def needs(self, load: Any, mu: Any) -> Any:
        """Moment on a for a load on b; mu = F/N has the sign of the sliding velocity."""
        f, k = self.friction, self.ratio
        if isinstance(f, mb.ThreadFriction):
            h = k if f.lead is None else f.lead / (2 * pi)
            axial, slope = load * k / h, np.arctan(h / f.radius)
            phi = np.arctan(mu / cos(f.flank_angle)) * np.sign(axial)
            return axial * f.radius * np.tan(slope + phi)
        x = mu * f.arm / (cos(f.pressure_angle) * cos(f.helix_angle))
        if f.radius is None:
            return k * load + np.abs(load) * x
        side = np.sign(k) * (-1 if f.internal else 1)
        tooth = load / (1 - side * x / f.radius * np.sign(load))
        return k * tooth + x * np.abs(tooth) / f.radius


@dataclass(frozen=True)
class Train:
    """Shaft 0 with a motor, stages, and a load on the last shaft or slide."""

    mechanism: mb.Mechanism
    stages: list[Stage]
    inertia: float
    motor: float
    load: float

    def motor_by_hand(self, accelerations: list[Any], coefficients: list[Any]) -> Any:
        """Moment of the motor, stage by stage from the load, for F/N of each stage."""
        need: Any = -self.load
        for k in range(len(self.stages) - 1, -1, -1):
            need = need + self.stages[k].inertia * accelerations[k + 1]
            need = self.stages[k].needs(need, coefficients[k])
        return need + self.inertia * accelerations[0]


def some_stage(draw: np.random.Generator, last: bool) -> tuple[float, Any, bool]:
    """Return ratio and friction of an element, and True if its b slides."""
    law = some_law(int(draw.integers(4)), float(10 ** draw.uniform(-2.5, -0.5)))
    kind, side = int(draw.integers(5 if last else 3)), float(draw.choice([-1.0, 1.0]))
    angle, lead_angle = float(draw.uniform(0.2, 0.5)), float(draw.uniform(0.02, 0.9))
    share, size = float(draw.uniform(0.02, 0.3)), float(10 ** draw.uniform(-2.0, 0.0))
    ratio = side * float(10 ** draw.uniform(-1.0, 1.0))
    if kind == 1 and 0.8 < abs(ratio) < 1.25:
        ratio *= 2.0
    if kind < 2:
        arm, helix = share * min(1.0, abs(ratio)) * size, float(draw.uniform(0.0, 0.5))
        friction = mb.MeshFriction(law, arm, size, angle, helix, internal=kind == 1, **SMALL)
        return ratio, friction, False
    if kind == 3:
        return ratio * size, mb.MeshFriction(law, share * size, None, angle, **SMALL), True
    radius = size / 10
    if kind == 2:
        lead = 2 * pi * radius * tan(lead_angle)
        return ratio * tan(lead_angle), mb.ThreadFriction(law, radius, angle, lead, **SMALL), False
    return side * radius * tan(lead_angle), mb.ThreadFriction(law, radius, angle, **SMALL), True


def random_train(seed: int) -> Train:
    """Return a train of one to four stages; sizes, ratios and friction vary over decades."""
    draw = np.random.default_rng(seed)
    m, stages = mb.Mechanism("train", gravity=(0.0, 0.0, 0.0)), list[Stage]()
    inertia = reflected = float(10 ** draw.uniform(-4, -1))
    rate = speed = float(draw.choice([-1.0, 1.0]) * 10 ** draw.uniform(0, 2))
    m.body("b0", 1.0, (inertia,) * 3)
    m.joint(mb.Revolute("j0", "ground", "b0", rate=rate))
    count = int(draw.integers(1, 5))
    for k in range(count):
        ratio, friction, linear = some_stage(draw, last=k == count - 1)
        rate *= ratio
        behind = float(10 ** draw.uniform(-0.5, 0.5)) * reflected / (rate / speed) ** 2
        reflected += behind * (rate / speed) ** 2
        joint, coupling = (mb.Prismatic, mb.Rolling) if linear else (mb.Revolute, mb.Gear)
        m.body(f"b{k + 1}", behind if linear else 1.0, (behind,) * 3)
        m.joint(joint(f"j{k + 1}", "ground", f"b{k + 1}", rate=rate))
        m.constraint(coupling(f"e{k}", f"j{k}", f"j{k + 1}", ratio, friction=friction))
        stages.append(Stage(ratio, friction, behind, linear))
    torque = reflected * abs(speed) * draw.uniform(0.5, 2.0)
    motor = float(draw.choice([-1.0, 1.0]) * torque)
    load = float(draw.choice([-1.0, 1.0]) * torque * draw.uniform(0.2, 2.0) * abs(speed / rate))
    m.force(mb.JointSpringDamper("motor", "j0", actuator=motor))
    m.force(mb.JointSpringDamper("load", f"j{count}", actuator=load))
    return Train(m, stages, inertia, motor, load)
