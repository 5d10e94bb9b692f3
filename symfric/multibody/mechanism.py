"""Builder of mechanisms and their models, and their equations as named CasADi Functions."""

from collections.abc import Iterable, Mapping, Sequence
from copy import copy
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import casadi as ca

from symfric.foundation import packed
from symfric.foundation.checks import kind, many, number, shown
from symfric.foundation.numeric import Array, Scalar, equals
from symfric.foundation.parameters import Variable, check_names
from symfric.foundation.shown import Showing, Shown, TextTable, among, counted, figure_of
from symfric.foundation.symbolic import plain, with_symbols
from symfric.foundation.variable import symbols_of
from symfric.model import Model, Variables
from symfric.multibody import checks
from symfric.multibody.actuated import ActuatedElement
from symfric.multibody.assembly import assemble
from symfric.multibody.constraints import Constraint
from symfric.multibody.element_friction import ElementFriction
from symfric.multibody.forces import Force, Gravity, SpringDamper
from symfric.multibody.joint import Joint
from symfric.multibody.prepare import (
    PreparedMechanism,
    following,
    in_absolute_coordinates,
    project,
    written,
)
from symfric.multibody.spatial import GROUND, Body, Frame, Vector, is_vector
from symfric.multibody.topology import Topology, spanning_tree

if TYPE_CHECKING:
    from matplotlib.figure import Figure


class Mechanism(packed.Portable, Showing):
    """Mechanism of bodies, joints, forces and constraints; `build` returns the `Model`.

    Example:
        m = Mechanism("pendulum")
        m.body("bob", mass=1.0, inertia=(0.01, 0.01, 0.01))
        m.frame("ground.pivot", z=(0, 1, 0))
        m.frame("bob.pivot", at=(0, 0, 0.5), z=(0, 1, 0))
        m.joint(Revolute("hinge", "ground.pivot", "bob.pivot", start=0.3))
        model = m.build()

    Numbers may be variables, which are then passed to `build(p=(mass, length))`. Bodies, frames and
    joints may be added in any order; `build` reports all mistakes in one ValueError.

    Args:
        name: C identifier.
        gravity: gravitational acceleration in world components [m/s^2]; (0, 0, 0) for none.
    """

    def __init__(self, name: str, gravity: Vector = (0.0, 0.0, -9.81)) -> None:
        self.name = name
        self.bodies: list[Body] = [Body(GROUND, 0.0, (0.0, 0.0, 0.0))]
        self.joints: list[Joint] = []
        self.forces: list[Force] = []
        self.constraints: list[Constraint] = []
        self.inputs: list[Variable] = []
        self.limits: dict[str, tuple[float, float]] = {}
        self.frames: list[tuple[str, Frame]] = []
        self._wrong: list[str] = []
        gravity = plain(gravity)
        if not is_vector(gravity):
            self._wrong.append(f"gravity: expected three numbers [m/s^2], got {gravity!r}")
        elif not all(equals(gravity[i], 0.0) for i in range(3)):
            self.forces.append(Gravity("gravity", gravity))

    def shown(self) -> Shown:
        """Return a table of the parts added so far; mistakes are reported by `build` only."""
        bodies = [body for body in self.bodies if body.name != GROUND]
        loops = max(0, len(self.joints) - len(bodies))
        rows = [(b.name, "body", f"{figure_of(b.mass)} kg", "") for b in bodies]
        for j in self.joints:
            law = type(j.friction.law).__name__ if j.friction is not None else ""
            rows.append((j.name, type(j).__name__, f"{j.parent} - {j.child}", law))
        for part in (*self.forces, *self.constraints):
            ends = f"{part.a} - {part.b}" if isinstance(part, SpringDamper) else ""
            law = getattr(getattr(part, "friction", part), "law", None)
            rubs = "" if law is None else type(law).__name__
            rows.append((part.name, type(part).__name__, ends, rubs))
        inputs = f"inputs: {among(v.name for v in self.inputs)}"
        return Shown(
            f"mechanism '{self.name}': {counted(len(bodies), 'body', 'bodies')}, "
            f"{counted(len(self.joints), 'joint')}, {counted(loops, 'closed loop')}",
            table=TextTable(("name", "what", "", "friction"), tuple(rows)),
            after=(inputs,) if self.inputs else (),
        )

    def thumbnail(self) -> "Figure | None":
        """Return the schematic; None if the mechanism cannot be built yet."""
        try:
            return self.schematic()
        except ValueError:
            return None

    def schematic(self, path: str | Path | None = None, p: Variables = ()) -> "Figure":
        """Return a labelled figure of the mechanism at its start, 85 mm wide.

        It has bodies, joints, forces other than gravity, and constraints with their names or
        parameters, coordinates (blue) and inputs (green) with their positive directions, and
        contacts with friction with their loads (orange).

        Args:
            path: output file; its suffix (.png, .svg, .pdf) selects the format.
            p: parameters, as for `build`.

        Raises:
            ValueError: all mistakes at once, each with its path; or the suffix is unknown.
        """
        from symfric.results.schematic import schematic  # noqa: PLC0415  (slow to import)

        return schematic(self.build(p), path)

    def to_pack(self) -> dict[str, Any]:
        """Return all added parts."""
        return vars(self)

    def body(
        self,
        name: str,
        mass: Scalar,
        inertia: Sequence[Any],
        com: Vector = (0.0, 0.0, 0.0),
        ideal: bool = False,
    ) -> None:
        """Add a rigid body; see `Body`."""
        self._take(self.bodies, Body(name, mass, inertia, com, ideal=ideal), Body)

    def frame(
        self,
        place: str,
        at: Vector = (0.0, 0.0, 0.0),
        z: Sequence[float] = (0.0, 0.0, 1.0),
        x: Sequence[float] | None = None,
        outline: Array | None = None,
    ) -> None:
        """Add the frame "body.frame"; see `Frame`."""
        if not isinstance(place, str):  # pyright: ignore[reportUnnecessaryIsInstance]
            self._wrong.append(f"frame: expected 'body.frame' of a known body, got {shown(place)}")
            return
        try:
            self.frames.append((place, Frame(plain(at), plain(z), plain(x), outline)))
        except ValueError as error:
            self.frames.append((place, Frame()))
            self._wrong.append(
                str(error).replace("frame", f"frame '{place}' >", 1).replace(">:", ">")
            )

    def joint(self, joint: Joint) -> None:
        """Add a joint; `build` reports mistakes with the path of the joint."""
        self._take(self.joints, joint, Joint)

    def force(self, force: Force) -> None:
        """Add a force; `build` reports mistakes with the path of the force."""
        self._take(self.forces, force, Force)

    def constraint(self, constraint: Constraint) -> None:
        """Add a constraint other than a joint: prescribed motion, coupling or expression."""
        self._take(self.constraints, constraint, Constraint)

    def _take(self, group: list[Any], part: object, wanted: type) -> None:
        what = wanted.__name__
        if not isinstance(part, wanted):
            message = f"expected a {what} of symfric.multibody, got {shown(part)}"
            kinds = [k.__name__.lower() for k in (Joint, Force, Constraint) if isinstance(part, k)]
            hint = "".join(f"; add it by {kind}(...)" for kind in kinds)
            self._wrong.append(f"{what.lower()}: {message}{hint}")
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

    def limit(self, name: str, lower: float, upper: float) -> None:
        """Set the bounds of a joint coordinate, its rate `<coordinate>_rate`, or an input.

        Optimal control keeps them, `simulate` ends with a `LimitWarning` if they are exceeded, and
        generated C clips its inputs to them. Absolute coordinates have only the bounds of inputs.
        """
        self.limits[name] = lower, upper

    def build(
        self, p: Variables = (), formulation: str = "joint", index: int | None = None
    ) -> Model:
        """Return the model.

        Args:
            p: parameters whose symbols the numbers of bodies, joints and forces may contain.
            formulation: "joint" uses the coordinates of the joints of a spanning tree and
                constraints for loops; "absolute" uses position and Euler parameters of every body
                and constraints for every joint, and is several times more expensive.
            index: treatment of the constraints: 0 integrates in their tangent space, 1 integrates
                all coordinates and projects at the end of every step. None selects the faster one:
                0 for absolute coordinates, 1 for joint coordinates. Both solutions agree to the
                tolerance.

        Raises:
            ValueError: all mistakes at once, each with its path.
        """
        if index not in (None, 0, 1):
            raise ValueError(f"mechanism '{self.name}': index: expected 0 or 1, got {index!r}")
        chosen = (0 if formulation == "absolute" else 1) if index is None else index
        return assemble(self.name, self.prepare(p, formulation), chosen)

    def prepare(self, p: Variables = (), formulation: str = "joint") -> PreparedMechanism:
        """Check the mechanism and return its equations of motion with their variables.

        Raises:
            ValueError: all mistakes at once, each with its path.
        """
        check_names(f"mechanism '{self.name}' formulation", [formulation], ("joint", "absolute"))
        where = f"mechanism '{self.name}' > p"
        p = many(where, p, "variables")
        for variable in p:
            kind(where, variable, Variable, "variables made by Variable(...)")
        made = written(self._tree(p), self.forces, self.constraints, p, tuple(self.inputs))
        made = _limited(f"mechanism '{self.name}' > limit", made, self.limits)
        loose = checks.undeclared_in_forces(made)
        self._refuse([*made.problems, *made.misfits, *checks.left_open(made), *loose])
        self._refuse(checks.infinite(made))
        self._refuse(checks.without_inertia(made))
        self._refuse(checks.idle(made.eq, self.constraints))
        if formulation == "absolute":
            self._refuse(checks.inseparable(made))
            made = in_absolute_coordinates(made, self.constraints)
            self._refuse([*made.problems, *checks.left_open(made)])
        return made

    def _refuse(self, problems: Iterable[str]) -> None:
        found = dict.fromkeys(f"mechanism '{self.name}' > {problem}" for problem in problems)
        if found:
            raise ValueError("\n".join(found))

    def _tree(self, p: Variables, closed: bool = True) -> Topology:
        """Return the bodies with their frames and the spanning tree of the joints.

        `closed`: True if the start values must close the loops.

        Raises:
            ValueError: all mistakes that can be found without equations, and inconsistent start
                values.
        """
        bodies, problems = self._placed()
        u = tuple(self.inputs)
        problems += checks.naming(bodies, self.joints, (*self.forces, *self.constraints), u)
        weights = list(checks.weights(bodies, p))
        bearings = list(checks.bearings(self.joints, symbols_of(p), symbols_of(u)))
        known = symbols_of((*p, *u))
        for part in (*self.constraints, *self.forces):
            friction, where = getattr(part, "friction", part), f"{part.kind} '{part.name}'"
            if isinstance(friction, ElementFriction):
                bearings += checks.rubbing(f"{where} > friction", friction, known)
            elif isinstance(friction, ActuatedElement):
                bearings += checks.rubbing(where, friction, known)
        self._refuse([*problems, *weights, *bearings] if problems else ())
        tree = spanning_tree({body.name: body for body in bodies}, self.joints)
        loose = list(checks.connected(tree))
        if weights and not bearings and not loose:
            # the start does not depend on masses
            unit = {b.name: Body(b.name, 1.0, (1.0, 1.0, 1.0), frames=b.frames) for b in bodies}
            made = written(replace(tree, bodies=unit), self.forces, self.constraints, p)
            weights += [*made.problems, *(made.misfits if closed else ())]
        self._refuse([*weights, *bearings, *loose])
        return tree

    def _placed(self) -> tuple[list[Body], list[str]]:
        """Return the bodies with their frames, and the mistakes found so far."""
        problems = list(self._wrong)
        if not isinstance(self.name, str) or not self.name.isidentifier():  # pyright: ignore[reportUnnecessaryIsInstance]
            problems.append(f"name: expected a C identifier, got {shown(self.name)}")
        placed = {body.name: dict(body.frames) for body in self.bodies}
        places = [place for place, _ in self.frames]
        for place, at in self.frames:
            body, _, frame = place.partition(".")
            if body not in placed or not frame:
                problems.append(f"frame '{place}': expected 'body.frame' of a known body")
            else:
                placed[body][frame] = at
            if places.count(place) > 1:
                problems.append(f"frame '{place}': expected every name once")
        return [replace(body, frames=placed[body.name]) for body in self.bodies], problems

    def assembled(self, p: Variables = ()) -> "Mechanism":
        """Return a copy that starts at the nearest positions and velocities that close all loops.

        Nonzero rates are kept if the rates of the other joints can satisfy the constraints.

        Args:
            p: parameters; the loops are closed for their start values.

        Raises:
            ValueError: all mistakes at once, each with its path; or no position near the start
                closes the loops.
        """
        made = written(self._tree(p, closed=False), self.forces, self.constraints, p)
        self._refuse(made.problems)
        at = made.position
        near = project(at, made.q0)
        if near is None:
            self._refuse(["start: expected positions from which the loops can be closed"])
            near = made.q0
        _, J, phi_t = at(near)
        rates = following(J, made.qd0, phi_t)
        placed, links = copy(self), made.eq.kin.topology.link_of
        placed.joints = []
        for joint in self.joints:
            if (link := links.get(joint.name)) is not None:
                start, rate = (tuple(x[link.rows].tolist()) for x in (near, rates))
                placed.joints.append(replace(joint, start=start, rate=rate))
            else:
                placed.joints.append(joint)
        return placed


def _limited(
    where: str, made: PreparedMechanism, limits: Mapping[str, tuple[float, float]]
) -> PreparedMechanism:
    """Return the equations with bounds of coordinates, rates and inputs, by name."""
    groups = {name: getattr(made, name) for name in ("q", "qd", "u")}
    check_names(where, limits, [v.name for group in groups.values() for v in group])
    ends = {name: dict(zip(("lower", "upper"), pair, strict=True)) for name, pair in limits.items()}
    changed = {
        name: tuple(replace(v, **ends[v.name]) if v.name in ends else v for v in group)
        for name, group in groups.items()
    }
    return replace(made, **changed) if limits else made
