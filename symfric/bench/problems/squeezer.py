"""Andrews' squeezing mechanism once more, as a `Mechanism` of joints: nobody derives its equations.

Seven bodies hang on three pins of the ground; three pins close their loops in one point, E.
"""

from collections.abc import Sequence
from dataclasses import replace
from functools import partial
from math import sin

from symfric.bench.problems import andrews as a
from symfric.bench.problems.problem import Problem
from symfric.model import Model, Output
from symfric.multibody import JointSpringDamper, Mechanism, PointOnLine, Revolute, SpringDamper

MASSES = (a.M1, a.M2, a.M3, a.M4, a.M5, a.M6, a.M7)
INERTIAS = (a.I1, a.I2, a.I3, a.I4, a.I5, a.I6, a.I7)
CENTRES = (
    (a.RA, 0.0), (-a.DA, 0.0), (a.SB, -a.SA), (0.0, a.EA - a.E), (a.TA, a.TB),
    (a.ZF - a.FA, 0.0), (a.UB, -a.UA),
)  # fmt: skip
PLACES = {
    "ground.O": (0.0, 0.0), "ground.A": (a.XA, a.YA), "ground.B": (a.XB, a.YB),
    "ground.C": (a.XC, a.YC), "K1.P": (a.RR, 0.0), "K2.E": (-a.D, 0.0), "K3.E": (0.0, -a.SS),
    "K3.D": (a.SD, -a.SC), "K4.E": (0.0, -a.E), "K5.F": (a.ZT, 0.0), "K6.E": (a.ZF, 0.0),
    "K7.G": (0.0, -a.U),
}  # fmt: skip
HINGES = {
    "beta": ("ground.O", "K1"), "theta": ("K1.P", "K2"), "gamma": ("ground.B", "K3"),
    "phi": ("K5.F", "K4"), "delta": ("ground.A", "K5"), "omega": ("K7.G", "K6"),
    "epsilon": ("ground.A", "K7"),
}  # fmt: skip
TURNED = {
    "K1": ("beta",), "K2": ("beta", "theta"), "K3": ("gamma",), "K4": ("phi", "delta"),
    "K5": ("delta",), "K6": ("omega", "epsilon"), "K7": ("epsilon",),
}  # fmt: skip
"""Body -> the angles that add up to its own."""


def mechanism() -> Mechanism:
    """Seven bodies in the plane x, y, a motor in the first hinge and a spring from C to D."""
    m = Mechanism("squeezer", gravity=(0.0, 0.0, 0.0))
    numbers = zip(MASSES, INERTIAS, CENTRES, strict=True)
    for k, (mass, inertia, (x, y)) in enumerate(numbers, start=1):
        m.body(f"K{k}", mass, (inertia, inertia, inertia), com=(x, y, 0.0))
    for place, (x, y) in PLACES.items():
        m.frame(place, at=(x, y, 0.0))
    for (name, ends), start in zip(HINGES.items(), a.START, strict=True):
        m.joint(Revolute(name, *ends, start=start))
    for body in ("K3", "K4", "K6"):
        m.joint(PointOnLine(f"E_{body}", "K2.E", f"{body}.E"))
    m.force(JointSpringDamper("motor", "beta", actuator=a.TORQUE))
    m.force(SpringDamper("spring", "ground.C", "K3.D", stiffness=a.C0, free_length=a.L0))
    return m


def model(formulation: str) -> Model:
    """Its equations, with the sine of every body's angle among the results."""
    made = mechanism().build(formulation=formulation)
    if formulation == "joint":
        return made
    own = {v.name: v.symbol for v in made.x}
    sines = {f"sin_{body}": 2 * own[f"{body}_e0"] * own[f"{body}_e3"] for body in TURNED}
    more = {name: Output(value, "1") for name, value in sines.items()}
    return replace(made, outputs={**made.outputs, **more})


def _sines(bodies: Sequence[str]) -> dict[str, float]:
    end = a.PROBLEM.reference
    return {f"sin_{body}": sin(sum(end[name] for name in TURNED[body])) for body in bodies}


PROBLEM, ABSOLUTE = (
    Problem(
        f"Andrews' squeezer, {formulation} coordinates",
        partial(model, formulation),
        a.PROBLEM.t_end,
        reference,
        drift=("constraint_position",),
    )
    for formulation, reference in (
        ("joint", a.PROBLEM.reference),
        ("absolute", _sines(list(TURNED))),
    )
)
