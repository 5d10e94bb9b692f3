"""Shafts on the ground with brakes, clutches and belts."""

from collections.abc import Callable
from typing import Any

import casadi as ca
from chains import attach

from symfric import BrownMcPhee, ExactCoulomb, Model, Trajectory, simulate
from symfric import multibody as mb
from symfric.laws import Law


def dry(mu: float, mu_d: float | None = None) -> Law:
    return ExactCoulomb(mu_s=mu, mu_d=mu if mu_d is None else mu_d)


def shafts(*rates: float, J: float = 0.5) -> mb.Mechanism:
    """Shafts a, b, ... on the ground without weight."""
    m = mb.Mechanism("train", gravity=(0.0, 0.0, 0.0))
    for name, rate in zip("abcdef", rates, strict=False):
        attach(m, mb.Revolute, name, f"shaft_{name}", J=J, rate=rate)
    return m


def turning(element: mb.Force, *rates: float, rope: bool = False) -> mb.Mechanism:
    m = shafts(*rates)
    if rope:
        attach(m, mb.Prismatic, "rope", "load")
    m.force(element)
    return m


def at_start(m: mb.Mechanism, formulation: str = "joint") -> Trajectory:
    return simulate(m.build(formulation=formulation), 1e-6, samples=2)


SHOE = (0.2, 0.3, 0.16, 0.17)
"""Radius and arms; leading shoes lock at mu = 16/17."""
K = 17 / 16


def drum(law: Law, P: Any, shoes: str = "leading") -> mb.DrumBrake:
    return mb.DrumBrake("w", "a", law, P, *SHOE, shoes=shoes)


def ramp(slope: float) -> Callable[[ca.SX], ca.SX]:
    def input_at(t: ca.SX) -> ca.SX:
        return slope * t

    return input_at


def driven(element: mb.Force, *rates: float) -> mb.Mechanism:
    m = turning(element, *rates)
    m.force(mb.JointSpringDamper("motor", "a", actuator=m.input("torque", "N m")))
    return m


def brake() -> Model:
    """A drum brake whose force is an input, initially 100 N."""
    m = shafts(9.0)
    m.force(drum(BrownMcPhee(), m.input("force", "N", start=100.0), "leading and trailing"))
    return m.build()
