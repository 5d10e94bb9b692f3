"""How mechanisms show themselves: bodies, joints with what rubs in them, forces, constraints."""

from typing import TYPE_CHECKING

from symfric.foundation.shown import Shown, Table, among, counted, figure_of
from symfric.multibody.body import GROUND
from symfric.multibody.forces import SpringDamper

if TYPE_CHECKING:
    from symfric.multibody.joint import Joint
    from symfric.multibody.mechanism import Mechanism


def shown(machine: "Mechanism") -> Shown:
    """What was added so far; `build` tells what is wrong with it."""
    bodies = [body for body in machine.bodies if body.name != GROUND]
    loops = max(0, len(machine.joints) - len(bodies))
    counts = [
        counted(len(bodies), "body", "bodies"),
        counted(len(machine.joints), "joint"),
        counted(loops, "closed loop"),
    ]
    rows = [(b.name, "body", f"{figure_of(b.mass)} kg", "") for b in bodies]
    rows += [_joint(joint) for joint in machine.joints]
    for force in machine.forces:
        ends = _between(force.a, force.b) if isinstance(force, SpringDamper) else ""
        rows.append((force.name, type(force).__name__, ends, ""))
    rows += [(c.name, type(c).__name__, "", "") for c in machine.constraints]
    after = [f"inputs: {among(v.name for v in machine.inputs)}"] if machine.inputs else []
    return Shown(
        f"mechanism '{machine.name}': {', '.join(counts)}",
        table=Table(("name", "what", "", "friction"), tuple(rows)),
        after=tuple(after),
    )


def _joint(joint: "Joint") -> tuple[str, ...]:
    rubs = type(joint.friction.law).__name__ if joint.friction is not None else ""
    return joint.name, type(joint).__name__, _between(joint.parent, joint.child), rubs


def _between(a: str, b: str) -> str:
    return f"{a} - {b}"
