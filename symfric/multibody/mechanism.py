"""The builder: collects bodies, joints and forces, checks them and writes the model."""

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import replace
from functools import partial
from typing import Any

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from symfric.model import Model, Variables
from symfric.multibody import checks
from symfric.multibody.animation import sketch
from symfric.multibody.assembly import assemble, coordinates
from symfric.multibody.body import GROUND, Body
from symfric.multibody.constraints import Constraint
from symfric.multibody.forces import Force, Gravity
from symfric.multibody.joints import Joint
from symfric.multibody.prepare import (
    Prepared,
    in_absolute_coordinates,
    numeric,
    start_problems,
    with_cuts,
    without_friction,
    written,
)
from symfric.multibody.results import results
from symfric.multibody.spatial import Frame, Vector
from symfric.multibody.topology import Topology, absolute, spanning_tree
from symfric.numeric import Scalar
from symfric.parameters import Variable, check_names

Array = NDArray[np.float64]
NONE = ca.SX(0, 1)
FORMULATIONS = ("joint", "absolute")


class Mechanism:
    """Collects bodies, joints, forces and constraints; `build` writes the `Model`.

    Example:
        m = Mechanism("pendulum")
        m.body("bob", mass=1.0, inertia=(0.01, 0.01, 0.01))
        m.frame("ground.pivot", z=(0, 1, 0))
        m.frame("bob.pivot", at=(0, 0, 0.5), z=(0, 1, 0))
        m.joint(Revolute("hinge", "ground.pivot", "bob.pivot", start=0.3))
        model = m.build()
    """

    def __init__(self, name: str, gravity: Vector = (0.0, 0.0, -9.81)) -> None:
        self.name = name
        self.bodies: list[Body] = [Body(GROUND, 0.0, (0.0, 0.0, 0.0))]
        self.joints: list[Joint] = []
        self.forces: list[Force] = []
        self.constraints: list[Constraint] = []
        self.inputs: list[Variable] = []
        self.frames: list[tuple[str, Frame]] = []
        if not all(isinstance(g, float | int) and g == 0 for g in gravity):  # type: ignore[union-attr]
            self.forces.append(Gravity("gravity", gravity))

    def body(
        self, name: str, mass: Scalar, inertia: Sequence[Any], com: Vector = (0.0, 0.0, 0.0)
    ) -> None:
        """Add a rigid body; see `Body`."""
        self.bodies.append(Body(name, mass, inertia, com))

    def frame(
        self,
        place: str,
        at: Vector = (0.0, 0.0, 0.0),
        z: Sequence[float] = (0.0, 0.0, 1.0),
        x: Sequence[float] | None = None,
    ) -> None:
        """Add the frame "body.frame"; see `Frame`."""
        self.frames.append((place, Frame(at, z, x)))

    def joint(self, joint: Joint) -> None:
        """Add a joint."""
        self.joints.append(joint)

    def force(self, force: Force) -> None:
        """Add a force."""
        self.forces.append(force)

    def constraint(self, constraint: Constraint) -> None:
        """Add a constraint that is no joint: prescribed motion, a coupling, an expression."""
        self.constraints.append(constraint)

    def input(self, name: str, unit: str, start: float = 0.0, nominal: float = 1.0) -> ca.SX:
        """Add an input and return its symbol, for actuators and user forces."""
        variable = Variable(name, unit, start=start, nominal=nominal)
        self.inputs.append(variable)
        return variable.symbol

    def build(
        self, p: Variables = (), formulation: str = "joint", index: int | None = None
    ) -> Model:
        """Write the model.

        Args:
            p: parameters, whose symbols the numbers of bodies, joints and forces may contain.
            formulation: "joint" has the coordinates of the joints of a spanning tree and
                constraints for its loops; "absolute" has position and Euler parameters of every
                body and constraints for every joint, several times dearer.
            index: how constraints are kept; 0 integrates in their tangent space, 1 in all
                coordinates with a projection at the end of every step; None takes what is faster,
                0 for absolute coordinates and 1 for those of joints. Same solution, to the
                tolerance.

        Raises:
            ValueError: all mistakes at once, each with its path.
        """
        if index not in (None, 0, 1):
            raise ValueError(f"mechanism '{self.name}': index: expected 0 or 1, got {index!r}")
        chosen = (0 if formulation == "absolute" else 1) if index is None else index
        made = self.prepare(p, formulation)
        u = tuple(self.inputs)
        guess = without_friction(made, p, u)
        parts = made.eq, tuple(self.joints), tuple(self.forces)
        more = partial(results, *parts, made.open_reactions), partial(sketch, *parts)
        cut = with_cuts(made, self.joints, self.forces)
        return assemble(
            self.name, made.eq, made.q, made.qd, made.labels, guess, p, u, more, chosen, cut
        )

    def prepare(self, p: Variables = (), formulation: str = "joint") -> Prepared:
        """The equations of motion with their variables, checked.

        Raises:
            ValueError: all mistakes at once, each with its path.
        """
        check_names(f"mechanism '{self.name}' formulation", [formulation], FORMULATIONS)
        bodies, problems = self._placed()
        symbols = ca.vertcat(NONE, *(v.symbol for v in p))
        values = ca.DM(ca.vertcat(NONE, *(v.start for v in p)))
        problems += checks.naming(bodies, self.joints, self.forces, self.constraints)
        problems += checks.numbers(bodies, self.joints, symbols, values)
        self._refuse(problems)
        by_name = {body.name: body for body in bodies}
        topology = spanning_tree(by_name, self.joints)
        self._refuse(checks.connected(bodies, topology))
        made = self._consistent(topology, symbols, values)
        if formulation == "absolute":
            names = [body.name for body in bodies if body.name != GROUND]
            made = in_absolute_coordinates(
                absolute(by_name, self.joints, names), made, self.joints, self.forces,
                self.constraints, symbols, values,
            )  # fmt: skip
            self._refuse(made.problems)
            self._refuse(_left_open(made))
        return made

    def _refuse(self, problems: Iterable[str]) -> None:
        found = [f"mechanism '{self.name}' > {problem}" for problem in problems]
        if found:
            raise ValueError("\n".join(found))

    def _placed(self) -> tuple[list[Body], list[str]]:
        """Bodies with their frames."""
        problems: list[str] = []
        names = [body.name for body in self.bodies]
        for place, _ in self.frames:
            body, _, frame = place.partition(".")
            if body not in names or not frame:
                problems.append(f"frame '{place}': expected 'body.frame' of a known body")
        placed = [
            replace(
                body,
                frames=body.frames
                | {
                    place.partition(".")[2]: frame
                    for place, frame in self.frames
                    if place.partition(".")[0] == body.name
                },
            )
            for body in self.bodies
        ]
        return placed, problems

    def _consistent(self, topology: Topology, p: ca.SX, values: ca.DM) -> Prepared:
        """Equations in joint coordinates, their start values checked."""
        q, qd = coordinates(topology)
        made = written(topology, self.joints, self.forces, self.constraints, q, qd, p, values)
        self._refuse(made.problems)
        self._refuse([*start_problems(made, p, values), *_left_open(made)])
        return made

    def assembled(self) -> "Mechanism":
        """A copy whose joints start at the nearest position and velocity that close all loops.

        Raises:
            ValueError: there is none near.
        """
        bodies, _ = self._placed()
        topology = spanning_tree({body.name: body for body in bodies}, self.joints)
        q, qd = coordinates(topology)
        made = written(
            topology, self.joints, self.forces, self.constraints, q, qd, NONE, ca.DM(0, 1)
        )
        self._refuse(made.problems)
        at = numeric(made.eq, NONE, ca.DM(0, 1))
        near = checks.project(at, made.q0)
        if near is None:
            self._refuse(["start: expected positions from which the loops can be closed"])
            near = made.q0
        _, J, phi_t = (part.full() for part in at(near))
        speed = J @ made.qd0 + phi_t[:, 0]
        rates = made.qd0 - np.linalg.lstsq(J, speed, rcond=None)[0] if J.size else made.qd0
        start = {
            link.joint.name: replace(
                link.joint,
                start=tuple(near[link.rows].tolist()),
                rate=tuple(rates[link.rows].tolist()),
            )
            for link in topology.links
        }
        copy = Mechanism(self.name)
        copy.bodies, copy.forces, copy.inputs = self.bodies, self.forces, self.inputs
        copy.constraints = self.constraints
        copy.frames, copy.joints = self.frames, [start.get(j.name, j) for j in self.joints]
        return copy


def _left_open(made: Prepared) -> Iterator[str]:
    """Friction that depends on reactions which redundant constraints leave open."""
    for name in made.undetermined:
        yield (
            f"joint '{name}' > friction: expected reactions that the motion determines, got a "
            f"normal force that the redundant constraints {', '.join(made.redundant)} leave open; "
            "close the loop with a joint of fewer constraints (PointOnLine in a planar mechanism)"
        )
    if made.singular:
        yield "start: expected independent constraints, got a singular position; start elsewhere"
