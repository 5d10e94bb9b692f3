"""Bad bodies, joints, forces, robots, moves and code: refused in one sentence."""

from collections.abc import Callable, Iterator
from functools import partial
from typing import Any

import casadi as ca
from bad_values import (
    INF,
    NAN,
    EntryPoint,
    Thing,
    choice,
    each,
    entry_point,
    entry_points_refuse,
    flag,
    function,
    number,
    parameter,
    path,
    thing,
    values,
    vectors,
)

import ocp
import symfric as sf
from symfric import multibody as mb
from symfric.codegen import generate, law_block, plant_block, verify
from symfric.laws import BrownMcPhee, Coulomb, LuGre, Stribeck

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


def entry_points_of_mechanisms() -> Iterator[EntryPoint]:
    def part(place: str, more: Callable[..., Any] | None = None, **fixed: Any) -> Any:
        """Puts one bad argument into `place`."""

        def call(**bad: Any) -> Any:
            if more is None:
                return pendulum(**fixed, **{place: bad})
            return pendulum(**fixed, **{place: partial(more, **bad)})

        return call

    yield entry_point(
        pendulum,
        "Mechanism",
        name=[None, 3, "", "a b", Thing(), []],
        gravity=vectors((0, 0, True)),
        part=thing(mb.Revolute, mb.SpringDamper),
    )
    rows = vectors()
    yield entry_point(
        part("body"),
        "Body",
        name=[None, 3, "", "a b", "ground", Thing(), []],
        mass=parameter(0.0, -1.0),
        inertia=[*rows, (0.0, 1.0, 1.0), (-1.0, 1.0, 1.0)],
        com=rows,
    )
    yield entry_point(
        part("frame"),
        "Frame",
        place=[None, 3, "", "bob", "unknown.x", Thing(), "bob."],
        at=rows,
        z=[*rows, (0, 0, 0)],
        x=[*rows[1:], (0, 1, 0)],
    )
    for kind in (mb.Revolute, mb.Prismatic, mb.Cylindrical):
        start = (0.0, 0.0) if kind is mb.Cylindrical else 0.0
        bad = [x for x in parameter() if x is not None]
        yield entry_point(
            part("joint", kind=kind),
            {"start": start},
            kind.__name__,
            name=[None, 3, "", "a b", Thing(), []],
            parent=[None, 3, "unknown", "ground.nothing", Thing(), "bob.pivot"],
            child=[None, 3, "unknown", "bob.nothing", Thing()],
            start=[*bad, (0.0, 0.0, 0.0)],
            rate=[*bad, (0.0, 0.0, 0.0)],
            friction=[3, "x", LuGre(), LuGre, Thing(), []],
        )
    rub: dict[str, Any] = {"law": Coulomb(), "radius": 0.01}
    yield entry_point(
        lambda **a: pendulum(joint={"friction": mb.JointFriction(**a)}),
        rub,
        "JointFriction",
        law=thing(Coulomb),
        radius=parameter(0.0, -1.0),
        length=parameter(0.0)[1:],
        width=parameter(-1.0)[1:],
        preload=parameter(),
        normal=parameter(-1.0)[1:],
        eps=parameter(-1.0),
    )
    springs = {"name": "s", "a": "ground.pivot", "b": "bob.pivot"}
    yield entry_point(
        part("force", lambda **a: mb.SpringDamper(**springs | {"stiffness": 1.0} | a)),
        "SpringDamper",
        name=[None, 3, "", "a b", Thing()],
        a=[None, 3, "unknown", Thing()],
        b=[None, 3, "unknown", Thing()],
        stiffness=parameter(),
        damping=parameter(),
        free_length=parameter(),
    )
    yield entry_point(
        part("force", lambda **a: mb.JointSpringDamper(**{"name": "s", "joint": "hinge"} | a)),
        "JointSpringDamper",
        joint=[None, 3, "unknown", Thing()],
        stiffness=parameter(),
        damping=parameter(),
        direction=[3, "up", Thing()],
    )
    gear = {"name": "g", "a": "hinge", "b": "hinge", "ratio": 1.0}
    motor = {"name": "p", "joint": "hinge", "motion": lambda t: t}
    yield entry_point(
        part("constraint", lambda **a: mb.Gear(**gear | a)),
        "Gear",
        a=[None, 3, "unknown", Thing()],
        ratio=parameter(0.0),
    )
    motions = [None, "x", Thing(), lambda: 1, lambda t: None, lambda t: "a", lambda t: 1j]
    motions += [lambda t: ca.SX.sym("a"), lambda t: ca.vertcat(t, t), lambda t: NAN]
    yield entry_point(
        part("constraint", lambda **a: mb.PrescribedMotion(**motor | a)),
        "PrescribedMotion",
        joint=[None, 3, "unknown", Thing()],
        motion=motions,
    )
    yield entry_point(
        part("input"),
        "Mechanism.input",
        name=[None, 3, "", "a b", Thing()],
        unit=[None, 3, Thing()],
        start=number(),
        nominal=number(0.0, -1.0),
    )
    yield entry_point(
        part("build"),
        "Mechanism.build",
        p=[3, "x", (3,), Thing(), [ca.SX.sym("a")]],
        formulation=choice(),
        index=[2, -1, "0", 0.5, Thing(), [0], NAN],
    )
    yield entry_point(
        lambda **a: mb.read_urdf(**a).build(),
        {"source": URDF},
        "read_urdf",
        source=[None, 3, [], Thing(), "", "<robot", "nothing.urdf", "<a/>", "<robot/>", b"x"],
        law=thing(Coulomb)[1:],
        level=parameter(-1.0),
        floating=flag(),
        bearings=[3, "j", {"k": None}, {"j": 3}, {"j": Coulomb()}, Thing()],
        gravity=rows[1:],
    )


def entry_points_of_control() -> Iterator[EntryPoint]:
    model = sf.drive(BrownMcPhee(), free=["m"])
    good = {
        "model": model,
        "T": 1.0,
        "cost": ocp.integral(lambda s: s.force**2),
        "start": {"x": 0.0, "v": 0.0},
        "end": {"x": 0.1, "v": 0.0},
    }

    def moved(model: sf.Model, T: float, cost: ocp.Cost, **more: Any) -> ocp.Problem:
        return ocp.Problem(ocp.Phase(model, T, **more), cost)

    wrong = (None, "1", NAN, INF, [0.0, 1.0, 2.0], (1.0, 0.0), (0.0,), (NAN, 1.0), True, 1j)
    ranges = [3, "x", [("x", 1)], Thing(), {"nonsense": 1.0}, {3: 1.0}, True]
    ranges += each("x", *wrong, (0.0, "a"), Thing())
    costs = (
        *(lambda s: s.nonsense, lambda s: "a", lambda s: None, lambda s: s.t * 0, lambda: 1),
        *(lambda s: ca.vertcat(s.x, s.x), lambda s: NAN, lambda s: ca.SX.sym("a")),
        lambda s: ca.MX.sym("a"),
    )
    nodes = [{t: {}} for t in ("a", 0.0, 1.5, NAN, None, True)]
    yield entry_point(
        moved,
        good,
        "Problem",
        model=thing(BrownMcPhee(), sf.Model),
        T=[*number(0.0, -1.0), (0.5, 1.0)],
        cost=[None, 3, "x", Thing(), lambda s: s.x, ocp.integral, *map(ocp.integral, costs)],
        start=ranges,
        end=ranges,
        bounds=ranges,
        via=[3, "x", Thing(), [0.5], *nodes, *each(0.5, 3, {"x": None}, {"nonsense": 1.0})],
        p=values("m", {"m": -1.0}),
    )
    yield entry_point(
        ocp.Free,
        {"lower": 0.1, "upper": 1.0},
        lower=number(0.0, -1.0, 2.0),
        upper=number(0.0, 0.05),
        guess=number(5.0, optional=True),
    )
    for make in (ocp.integral, ocp.at_end):
        yield entry_point(make, expression=[None, *function()])
    yield entry_point(lambda w: ocp.TIME * w, "Cost * weight", w=number())
    yield entry_point(
        ocp.rest_to_rest,
        {"model": model, "distance": 0.1, "T": 1.0, "limit": 9.0},
        model=thing(),
        distance=number(),
        T=number(0.0),
        limit=number(0.0, -1.0),
        position=choice(),
        velocity=choice(),
        force=choice(),
    )
    fast = {"problem": moved(**good), "intervals": 4, "friction": "smooth", "verify": False}
    fast |= {"solver": ocp.Ipopt(max_iter=1), "throw": False}
    meshes = ([], [0.0], [0.0, 0.5], [0.0, 0.5, 0.5, 1.0], [0.0, NAN, 1.0])
    guesses = ("a", NAN, [[1.0]], [], lambda: 1, lambda t: "a", lambda t: [1.0, 2.0], None, 1j)
    yield entry_point(
        ocp.solve,
        fast,
        problem=thing(model, ocp.Problem),
        intervals=["4", 0, -1, 2.5, NAN, {}, Thing(), True, 1j, 10**9, *meshes],
        scheme=[3, "radau", Thing(), ocp.Radau],
        friction=choice(),
        starts=[0, 2.5, "a", None],
        max_time=number(0.0, -1.0, optional=True),
        guess=[3, "x", Thing(), True, {"nonsense": 1.0}, {3: 1.0}, *each("x", *guesses)],
        solver=[3, "ipopt", Thing(), ocp.Ipopt, ocp.Ipopt(nonsense=1)],
        verify=flag(),
        throw=flag(),
        progress=function(),
        tolerance=number(0.0, -1.0),
    )


def entry_points_of_code() -> Iterator[EntryPoint]:
    yield entry_point(
        generate,
        {"law": Stribeck(), "out": "c"},
        law=thing(Coulomb, sf.rabinowicz(LuGre())),
        out=path(),
        name=[3, "a b", "1a", "for", Thing(), [], ""],
        real=[None, 3, "half", ["half"], [], Thing(), [3]],
        free=[3, "mu_s", ["nonsense"], [3], Thing()],
    )
    yield entry_point(
        law_block,
        {"law": LuGre()},
        law=thing(LuGre),
        h=number(0.0, -1.0, optional=True),
        free=[3, "mu_s", ["nonsense"], [3], Thing()],
        name=[3, "a b", Thing(), ""],
    )
    yield entry_point(
        plant_block,
        {"model": sf.rabinowicz(BrownMcPhee())},
        model=thing(LuGre()),
        h=number(0.0, -1.0, optional=True),
        method=choice(),
        name=[3, "a b", Thing(), ""],
    )
    yield entry_point(verify, generated=thing())


test_every_entry_point_refuses_bad_input_in_a_sentence = entry_points_refuse(
    {
        "mechanisms": entry_points_of_mechanisms,
        "control": entry_points_of_control,
        "code": entry_points_of_code,
    }
)
