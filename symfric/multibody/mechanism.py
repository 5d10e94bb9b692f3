"""Builder: collects bodies, joints and forces, checks them and writes the model."""

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import replace
from functools import partial
from typing import TYPE_CHECKING, Any

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from symfric.foundation import packed
from symfric.foundation.checks import kind, many, number, shown
from symfric.foundation.numeric import Scalar, equals
from symfric.foundation.parameters import Variable, check_names
from symfric.foundation.shown import Showing, Shown
from symfric.foundation.symbolic import plain, with_symbols
from symfric.foundation.variable import starts_of, symbols_of
from symfric.model import Model, Variables
from symfric.multibody import checks
from symfric.multibody.assembly import assemble, coordinates
from symfric.multibody.constraints import Constraint
from symfric.multibody.forces import Force, Gravity
from symfric.multibody.joint import Joint
from symfric.multibody.prepare import (
    Prepared,
    in_absolute_coordinates,
    infinite,
    numeric,
    undeclared,
    with_cuts,
    without_friction,
    without_inertia,
    written,
)
from symfric.multibody.results import results, sketch, thumbnail
from symfric.multibody.results import shown as shown_of
from symfric.multibody.spatial import GROUND, Body, Frame, Vector, is_vector
from symfric.multibody.topology import Topology, absolute, spanning_tree

if TYPE_CHECKING:
    from matplotlib.figure import Figure

Array = NDArray[np.float64]
FORMULATIONS = ("joint", "absolute")


class Mechanism(Showing):
    """Mechanism of bodies, joints, forces and constraints; `build` writes the `Model`.

    Example:
        m = Mechanism("pendulum")
        m.body("bob", mass=1.0, inertia=(0.01, 0.01, 0.01))
        m.frame("ground.pivot", z=(0, 1, 0))
        m.frame("bob.pivot", at=(0, 0, 0.5), z=(0, 1, 0))
        m.joint(Revolute("hinge", "ground.pivot", "bob.pivot", start=0.3))
        model = m.build()

    Numbers may be variables, which are passed to `build(p=(mass, length))`. Bodies, frames and
    joints may be added in any order; `build` reports all mistakes in one ValueError.

    Args:
        name: C identifier.
        gravity: in world components [m/s^2]; (0, 0, 0) for none.
    """

    def __init__(self, name: str, gravity: Vector = (0.0, 0.0, -9.81)) -> None:
        self.name = name
        self.bodies: list[Body] = [Body(GROUND, 0.0, (0.0, 0.0, 0.0))]
        self.joints: list[Joint] = []
        self.forces: list[Force] = []
        self.constraints: list[Constraint] = []
        self.inputs: list[Variable] = []
        self.frames: list[tuple[str, Frame]] = []
        self._wrong: list[str] = []
        gravity = plain(gravity)
        if not is_vector(gravity):
            self._wrong.append(f"gravity: expected three numbers [m/s^2], got {gravity!r}")
        elif not all(equals(gravity[i], 0.0) for i in range(3)):
            self.forces.append(Gravity("gravity", gravity))

    def shown(self) -> Shown:
        """Describe the parts added so far."""
        return shown_of(
            self.name, self.bodies, self.joints, self.forces, self.constraints, self.inputs
        )

    def thumbnail(self) -> "Figure | None":
        """Return a small figure of the machine at its start; None if it cannot be built yet."""
        try:
            made = self.prepare()
        except ValueError:
            return None
        drawn = sketch(made.eq, self.joints, self.forces, {})
        places = ca.Function("places", [made.eq.q], [drawn.places])(made.q0)
        return thumbnail(drawn, places.full())

    def to_pack(self) -> dict[str, Any]:
        """Return all added parts."""
        return vars(self)

    def __copy__(self) -> "Mechanism":
        """Return a mechanism with the same symbols."""
        return packed.shallow(self)

    def __reduce__(self) -> tuple[Any, ...]:
        """Pickle all added parts; symbols keep their identity."""
        return packed.loads, (packed.dumps(self),)

    def body(
        self,
        name: str,
        mass: Scalar,
        inertia: Sequence[Any],
        com: Vector = (0.0, 0.0, 0.0),
        ideal: bool = False,
    ) -> None:
        """Add a rigid body; see `Body`."""
        if isinstance(name, str):  # pyright: ignore[reportUnnecessaryIsInstance]
            numbers = plain((mass, inertia, com))
            self.bodies.append(Body(name, *numbers, ideal=ideal))
        else:
            self._wrong.append(f"body > name: expected a text, got {shown(name)}")

    def frame(
        self,
        place: str,
        at: Vector = (0.0, 0.0, 0.0),
        z: Sequence[float] = (0.0, 0.0, 1.0),
        x: Sequence[float] | None = None,
    ) -> None:
        """Add the frame "body.frame"; see `Frame`."""
        if not isinstance(place, str):  # pyright: ignore[reportUnnecessaryIsInstance]
            self._wrong.append(f"frame: expected 'body.frame' of a known body, got {shown(place)}")
            return
        try:
            self.frames.append((place, Frame(plain(at), plain(z), plain(x))))
        except ValueError as error:
            self.frames.append((place, Frame()))
            self._wrong.append(
                str(error).replace("frame", f"frame '{place}' >", 1).replace(">:", ">")
            )

    def joint(self, joint: Joint) -> None:
        """Add a joint; `build` reports its mistakes, with its path."""
        self._take(self.joints, joint, Joint)

    def force(self, force: Force) -> None:
        """Add a force; `build` reports its mistakes, with its path."""
        self._take(self.forces, force, Force)

    def constraint(self, constraint: Constraint) -> None:
        """Add a constraint other than a joint: prescribed motion, a coupling, an expression."""
        self._take(self.constraints, constraint, Constraint)

    def _take(self, group: list[Any], part: object, wanted: type) -> None:
        what = wanted.__name__
        if not isinstance(part, wanted):
            said = f"expected a {what} of symfric.multibody, got {shown(part)}"
            self._wrong.append(f"{what.lower()}: {said}")
        elif odd := list(checks.texts(part)):
            self._wrong += [f"{what.lower()} {shown(getattr(part, 'name', ''))} > {t}" for t in odd]
        else:
            group.append(with_symbols(part))

    def input(self, name: str, unit: str, start: float = 0.0, nominal: float = 1.0) -> ca.SX:
        """Add an input and return its symbol, for actuators and user forces."""
        start = number(f"mechanism '{self.name}' > input '{name}' > start", start)
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
                body and constraints for every joint, several times more expensive.
            index: treatment of the constraints: 0 integrates in their tangent space, 1 in all
                coordinates with a projection at the end of every step; None takes the faster one,
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
        p = tuple(p)
        guess = without_friction(made, p, u)
        parts = made.eq, tuple(self.joints), tuple(self.forces)
        more = partial(results, *parts, made.open_reactions), partial(sketch, *parts)
        cut = with_cuts(made, self.joints, self.forces)
        return assemble(
            self.name, made.eq, made.q, made.qd, made.labels, guess, p, u, more, chosen, cut
        )

    def prepare(self, p: Variables = (), formulation: str = "joint") -> Prepared:
        """Return the equations of motion with their variables, checked.

        Raises:
            ValueError: all mistakes at once, each with its path.
        """
        check_names(f"mechanism '{self.name}' formulation", [formulation], FORMULATIONS)
        where = f"mechanism '{self.name}' > p"
        p = many(where, p, "variables")
        for variable in p:
            kind(where, variable, Variable, "variables made by Variable(...)")
        symbols = symbols_of(p)
        values = ca.DM(starts_of(p))
        bodies, tree = self._hung(symbols, values)
        made = self._written(tree, symbols, values)
        u = symbols_of(self.inputs)
        loose = undeclared(made.eq, self.joints, self.forces, symbols, u)
        self._refuse([*made.problems, *made.misfits, *_left_open(made), *loose])
        self._refuse(infinite(made, self.joints, self.forces, symbols, values))
        self._refuse(without_inertia(made, symbols, values))
        if formulation == "absolute":
            self._refuse(_inseparable(bodies, symbols, values))
            by_name = {body.name: body for body in bodies}
            names = [body.name for body in bodies if body.name != GROUND]
            made = in_absolute_coordinates(
                absolute(by_name, self.joints, names), made, self.joints, self.forces,
                self.constraints, symbols, values,
            )  # fmt: skip
            self._refuse(made.problems)
            self._refuse(_left_open(made))
        return made

    def _refuse(self, problems: Iterable[str]) -> None:
        found = dict.fromkeys(f"mechanism '{self.name}' > {problem}" for problem in problems)
        if found:
            raise ValueError("\n".join(found))

    def _hung(self, p: ca.SX, values: ca.DM, closed: bool = True) -> tuple[list[Body], Topology]:
        """Return the bodies in their places and their spanning tree.

        `closed`: True if the start has to close the loops.

        Raises:
            ValueError: all mistakes that can be found without equations, and those of the start.
        """
        bodies, problems = self._placed()
        u = symbols_of(self.inputs)
        problems += checks.naming(
            bodies, self.joints, self.forces, self.constraints, tuple(self.inputs)
        )
        weights = list(checks.weights(bodies, p, values))
        bearings = list(checks.bearings(self.joints, p, u))
        self._refuse([*problems, *weights, *bearings] if problems else ())
        tree = spanning_tree({body.name: body for body in bodies}, self.joints)
        loose = list(checks.connected(bodies, tree))
        if weights and not bearings and not loose:
            # the start does not depend on masses
            unit = {
                b.name: replace(b, mass=1.0, inertia=(1.0, 1.0, 1.0), com=(0.0, 0.0, 0.0))
                for b in bodies
            }
            made = self._written(replace(tree, bodies=unit), p, values)
            weights += [*made.problems, *(made.misfits if closed else ())]
        self._refuse([*weights, *bearings, *loose])
        return bodies, tree

    def _placed(self) -> tuple[list[Body], list[str]]:
        """Return the bodies with their frames."""
        problems = list(self._wrong)
        if not isinstance(self.name, str) or not self.name.isidentifier():  # pyright: ignore[reportUnnecessaryIsInstance]
            problems.append(f"name: expected a C identifier, got {shown(self.name)}")
        names = [body.name for body in self.bodies]
        places = [place for place, _ in self.frames]
        for place in places:
            body, _, frame = place.partition(".")
            if body not in names or not frame:
                problems.append(f"frame '{place}': expected 'body.frame' of a known body")
            if places.count(place) > 1:
                problems.append(f"frame '{place}': expected every name once")
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

    def _written(self, tree: Topology, p: ca.SX, values: ca.DM) -> Prepared:
        """Return the equations in joint coordinates."""
        q, qd = coordinates(tree)
        return written(tree, self.joints, self.forces, self.constraints, q, qd, p, values)

    def assembled(self, p: Variables = ()) -> "Mechanism":
        """Return a copy whose joints start at the nearest position and velocity that close all
        loops.

        Nonzero rates are kept if the other joints can follow them.

        Args:
            p: parameters, at whose start values they close.

        Raises:
            ValueError: all mistakes at once, each with its path; there is no position near.
        """
        symbols = symbols_of(p)
        values = ca.DM(starts_of(p))
        _, tree = self._hung(symbols, values, closed=False)
        made = self._written(tree, symbols, values)
        self._refuse(made.problems)
        at = numeric(made.eq, symbols, values)
        near = checks.project(at, made.q0)
        if near is None:
            self._refuse(["start: expected positions from which the loops can be closed"])
            near = made.q0
        _, J, phi_t = (part.full() for part in at(near))
        rates = checks.following(J, made.qd0, phi_t[:, 0])
        start = {
            link.joint.name: replace(
                link.joint,
                start=tuple(near[link.rows].tolist()),
                rate=tuple(rates[link.rows].tolist()),
            )
            for link in tree.links
        }
        copy = Mechanism(self.name)
        copy.bodies, copy.forces, copy.inputs = self.bodies, self.forces, self.inputs
        copy.constraints = self.constraints
        copy.frames, copy.joints = self.frames, [start.get(j.name, j) for j in self.joints]
        return copy


def _inseparable(bodies: Iterable[Body], p: ca.SX, values: ca.DM) -> Iterator[str]:
    """Yield messages about bodies that have no equations of their own."""
    for body in bodies:
        strict = replace(body, ideal=False)
        if body.ideal and body.name != GROUND and any(strict.problems(p, values)):
            yield (
                f"body '{body.name}': expected a rigid body in absolute coordinates, got a "
                "massless link, a point or an unphysical body; use joint coordinates"
            )


def _left_open(made: Prepared) -> Iterator[str]:
    """Yield messages about friction that depends on undetermined reactions."""
    for name in made.undetermined:
        yield (
            f"joint '{name}' > friction: expected reactions that the motion determines, got a "
            f"normal force that the redundant constraints {', '.join(made.redundant)} leave open; "
            "close the loop with a joint of fewer constraints: PlanarRevolute, PlanarPrismatic or "
            "PinInSlot in a planar mechanism, a ball or a PointOnLine in space"
        )
    if made.singular:
        yield "start: expected independent constraints, got a singular position; start elsewhere"
