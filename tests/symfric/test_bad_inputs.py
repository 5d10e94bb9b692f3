"""Bad Python input: every public function refuses it in one sentence.

The table entry_points.toml lists functions and their bad values. The functions of this file give
the names in its expressions, and functions that follow from fields, such as all laws.
"""

from collections.abc import Callable, Iterator
from dataclasses import fields
from functools import partial
from typing import Any

import bad_values as bad
import casadi as ca
import numpy as np
from bad_values import INF, NAN, EntryPoint, Thing, entry_point, entry_points_refuse
from tables import table

import ocp
import symfric as sf
from symfric import figures
from symfric import multibody as mb
from symfric.laws import BrownMcPhee, Coulomb, LuGre, Stribeck
from symfric.laws.catalogue import ALL_LAWS, POPULATIONS, WRAPPERS
from symfric.model import Model
from symfric.scenes import ALL_SCENES, Rabinowicz

TABLE = table(__file__, "entry_points")


def belt() -> Model:
    return sf.rabinowicz(BrownMcPhee(), free=["mu_d"])


def listed(group: str, **names: Any) -> Iterator[EntryPoint]:
    """Yield the functions of a group of the table; all its expressions know the names here."""
    return bad.listed(TABLE[group], globals() | names)


def some_parameter(*more: Any) -> list[Any]:
    """A few values that are no parameter; all fields of laws and scenes share their checks."""
    return [None, "0.1", NAN, *more]


def entry_points_of_simulation() -> Iterator[EntryPoint]:
    def members(name: str) -> list[Any]:
        """As `values`, where arrays are good."""
        numbers = [
            x for x in bad.values(name) if not (isinstance(x, dict) and np.ndim(x.get(name)))
        ]
        rows = ([0.1, NAN], [], [[0.1]], ["a"], [None], [True, False], [1j])
        return numbers + [{name: row} for row in rows]

    functions = (
        *(lambda: 1.0, lambda t: "a", lambda t: None, lambda t: ca.vertcat(t, t), sf.Hold),
        *(lambda t: __import__("math").sin(t), lambda t: 1.0 if t > 0 else 0.0, lambda t: NAN),
        *(lambda t: ca.SX.sym("a"), lambda t: ca.MX.sym("a"), lambda t: [1.0, 2.0]),
        *(lambda t: 1j, lambda t: 1 / 0),
    )
    quick = {"t_end": 0.01, "backend": "vm"}
    yield from listed(
        "simulation", quick=quick, model=belt(), driven=sf.drive(BrownMcPhee()), members=members,
        functions=functions,
    )  # fmt: skip
    rows = [3.0, None, "ab", [NAN], [INF], [[0.0]], {}, Thing(), 1j, [None], ["a"], True]
    for kind in (sf.Hold, sf.Linear):
        yield entry_point(
            kind, {"t": [0.0], "values": [1.0]}, t=[*rows, [], [0.0, 1.0]],
            values=[*(row for row in rows if row != [[0.0]]), [], [0.0, 1.0]],
        )  # fmt: skip
        unordered = [[0.0, 0.0], [1.0, 0.0], [0.0, NAN]]
        yield entry_point(kind, {"t": [0.0, 1.0], "values": [1.0, 2.0]}, t=unordered)


def entry_points_of_a_trajectory() -> Iterator[EntryPoint]:
    run = sf.simulate(belt(), 0.01, backend="vm", samples=5, sensitivities=["mu_d"])
    unordered = ([], [0.01, 0.005], [0.0, 0.0])  # fine here
    inside = [x for x in bad.times([0.02], [-1.0], NAN, INF)[1:] if x not in unordered]
    return listed("trajectory", run=run, inside=inside)


def entry_points_of_models() -> Iterator[EntryPoint]:
    x = sf.Variable("x", "m")
    return listed(
        "models", x=x, good={"name": "m", "x": (x,), "ode": -x.symbol},
        collection=[3, "x", (3,), Thing(), (x,)], model=belt(),
    )  # fmt: skip


def entry_points_of_laws() -> Iterator[EntryPoint]:
    for kind in (ALL_LAWS | POPULATIONS).values():
        wrong, every = dict[str, list[Any]](), bad.parameter if kind is LuGre else some_parameter
        for item in fields(kind):
            if "unit" in item.metadata:
                more = [item.metadata["lower"] - 1.0, item.metadata["upper"] + 1.0]
                wrong[item.name] = every(*(x for x in more if abs(x) < INF))
            elif "choices" in item.metadata:
                wrong[item.name] = bad.choice()
        yield entry_point(kind, **wrong)
    for name, wrapper in WRAPPERS.items():
        yield entry_point(wrapper, {"law": Stribeck()}, name, law=bad.thing(Coulomb))
    rows = [None, 3.0, "ab", [], [0.0], [0.0, NAN], [[0.0, 1.0]], {}, Thing(), [1j, 2], ["a", "b"]]
    yield from listed("laws", rows=rows)


def entry_points_of_scenes() -> Iterator[EntryPoint]:
    for name, kind in ALL_SCENES.items():
        every = bad.parameter if kind is Rabinowicz else some_parameter
        wrong = {"law": bad.thing(BrownMcPhee, "lugre", belt())}
        for item in fields(kind):
            if "unit" in item.metadata:
                low = item.metadata["lower"]
                wrong[item.name] = every(*([low - 1.0] if low > -INF else []))
        yield entry_point(kind, {"law": BrownMcPhee()}, name, **wrong)
    yield from listed("scenes")


def entry_points_of_figures() -> Iterator[EntryPoint]:
    for name, make in figures.FIGURES.items():
        law, load = bad.thing(LuGre), bad.number(0.0, -1.0)
        yield entry_point(make, {"law": LuGre()}, name, law=law, N=load)
    yield from listed("figures", data=figures.compare([Coulomb()]))


URDF = """<robot name="r"><link name="a"/><link name="b"><inertial><mass value="1"/>
<inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial></link>
<joint name="j" type="continuous"><parent link="a"/><child link="b"/></joint></robot>"""


def pendulum(**changes: Any) -> Any:
    """A pendulum built with something else in one place."""
    given = {"name": "m", "gravity": (0, 0, -9.81)} | changes
    m = mb.Mechanism(given["name"], given["gravity"])
    body = {"name": "bob", "mass": 1.0, "inertia": (0.01, 0.01, 0.01), "com": (0.0, 0.0, 0.0)}
    m.body(**body | changes.get("body", {}))
    m.frame("ground.pivot", z=(0, 1, 0))
    m.frame(**{"place": "bob.pivot", "at": (0, 0, 0.5), "z": (0, 1, 0)} | changes.get("frame", {}))
    kind: Callable[..., Any] = changes.get("kind", mb.Revolute)
    hinge = {"name": "hinge", "parent": "ground.pivot", "child": "bob.pivot", "start": 0.3}
    m.joint(kind(**hinge | changes.get("joint", {})))
    if "part" in changes:
        m.joint(changes["part"])
    if "force" in changes:
        m.force(changes["force"]())
    if "constraint" in changes:
        m.constraint(changes["constraint"]())
    if "input" in changes:
        m.input(**{"name": "tau", "unit": "N m"} | changes["input"])
    return m.build(**changes.get("build", {}))


def part(place: str, more: Callable[..., Any] | None = None, **fixed: Any) -> Callable[..., Any]:
    """Return a function that builds the pendulum with its arguments in `place`."""

    def call(**wrong: Any) -> Any:
        return pendulum(**fixed, **{place: wrong if more is None else partial(more, **wrong)})

    return call


def entry_points_of_mechanisms() -> Iterator[EntryPoint]:
    wrong = [x for x in bad.parameter() if x is not None]
    motions = [None, "x", Thing(), lambda: 1, lambda t: None, lambda t: "a", lambda t: 1j]
    motions += [lambda t: ca.SX.sym("a"), lambda t: ca.vertcat(t, t), lambda t: NAN]
    return listed("mechanisms", rows=bad.vectors(), motions=motions, wrong=wrong)


def entry_points_of_control() -> Iterator[EntryPoint]:
    model = sf.drive(BrownMcPhee(), free=["m"])
    effort = ocp.integral(lambda s: s.force**2)
    ends = {"start": {"x": 0.0, "v": 0.0}, "end": {"x": 0.1, "v": 0.0}}
    good = {"model": model, "T": 1.0, "cost": effort, **ends}

    def moved(model: sf.Model, T: float, cost: ocp.Cost, **more: Any) -> ocp.Problem:
        return ocp.Problem(ocp.Phase(model, T, **more), cost)

    wrong = (None, "1", NAN, INF, [0.0, 1.0, 2.0], (1.0, 0.0), (0.0,), (NAN, 1.0), True, 1j)
    ranges = [3, "x", [("x", 1)], Thing(), {"nonsense": 1.0}, {3: 1.0}, True]
    ranges += bad.each("x", *wrong, (0.0, "a"), Thing())
    costs = (
        *(lambda s: s.nonsense, lambda s: "a", lambda s: None, lambda s: s.t * 0, lambda: 1),
        *(lambda s: ca.vertcat(s.x, s.x), lambda s: NAN, lambda s: ca.SX.sym("a")),
        lambda s: ca.MX.sym("a"),
    )
    fast = {"problem": moved(**good), "intervals": 4, "friction": "smooth", "verify": False}
    fast |= {"solver": ocp.Ipopt(max_iter=1), "throw": False}
    meshes = ([], [0.0], [0.0, 0.5], [0.0, 0.5, 0.5, 1.0], [0.0, NAN, 1.0])
    guesses = ("a", NAN, [[1.0]], [], lambda: 1, lambda t: "a", lambda t: [1.0, 2.0], None, 1j)
    return listed(
        "control", model=model, good=good, moved=moved, ranges=ranges, costs=costs, fast=fast,
        meshes=meshes, guesses=guesses,
    )  # fmt: skip


test_every_entry_point_refuses_bad_input_in_a_sentence = entry_points_refuse(
    {
        "simulation": entry_points_of_simulation,
        "trajectory": entry_points_of_a_trajectory,
        "models": entry_points_of_models,
        "laws": entry_points_of_laws,
        "scenes": entry_points_of_scenes,
        "figures": entry_points_of_figures,
        "mechanisms": entry_points_of_mechanisms,
        "control": entry_points_of_control,
        "code": lambda: listed("code"),
    }
)
