"""Bad bodies, joints, forces and robots: refused in one sentence, at the latest when built."""

from collections.abc import Callable, Iterator
from functools import partial
from typing import Any

import casadi as ca
from bad_values import (
    INF,
    NAN,
    Door,
    Thing,
    choice,
    every_door_refuses,
    flag,
    number,
    parameter,
    thing,
)

from symfric.laws import Coulomb, LuGre
from symfric.multibody import (
    Cylindrical,
    Gear,
    JointFriction,
    JointSpringDamper,
    Mechanism,
    PrescribedMotion,
    Prismatic,
    Revolute,
    SpringDamper,
    read_urdf,
)

URDF = """<robot name="r"><link name="a"/><link name="b"><inertial><mass value="1"/>
<inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial></link>
<joint name="j" type="continuous"><parent link="a"/><child link="b"/></joint></robot>"""


def pendulum(**changes: Any) -> Any:
    """A pendulum built with something else in one place."""
    given = {"name": "m", "gravity": (0, 0, -9.81)} | changes
    m = Mechanism(given["name"], given["gravity"])
    body = {"name": "bob", "mass": 1.0, "inertia": (0.01, 0.01, 0.01), "com": (0.0, 0.0, 0.0)}
    m.body(**body | changes.get("body", {}))
    m.frame("ground.pivot", z=(0, 1, 0))
    m.frame(**{"place": "bob.pivot", "at": (0, 0, 0.5), "z": (0, 1, 0)} | changes.get("frame", {}))
    kind: Callable[..., Any] = changes.get("kind", Revolute)
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


def doors_of_mechanisms() -> Iterator[Door]:
    def part(place: str, more: Callable[..., Any] | None = None, **fixed: Any) -> Any:
        """Puts one bad argument into `place`."""

        def call(**bad: Any) -> Any:
            if more is None:
                return pendulum(**fixed, **{place: bad})
            return pendulum(**fixed, **{place: partial(more, **bad)})

        return call

    yield Door(
        "Mechanism",
        pendulum,
        {},
        {
            "name": [None, 3, "", "a b", Thing(), []],
            "gravity": [
                None,
                3,
                "abc",
                (0, 0),
                (0, 0, NAN),
                (0, 0, INF),
                ("a", 0, 0),
                Thing(),
                (0, 0, None),
                (0, 0, True),
                (0, 0, 1j),
            ],
            "part": thing(Revolute, SpringDamper),
        },
    )
    rows = [
        None,
        3,
        "abc",
        (1.0,),
        (1.0, NAN, 1.0),
        ("a", 1.0, 1.0),
        Thing(),
        (1.0, None, 1.0),
        (1.0, INF, 1.0),
        (1.0, 1j, 1.0),
    ]
    yield Door(
        "Body",
        part("body"),
        {},
        {
            "name": [None, 3, "", "a b", "ground", Thing(), []],
            "mass": parameter(0.0, -1.0),
            "inertia": [*rows, (0.0, 1.0, 1.0), (-1.0, 1.0, 1.0)],
            "com": rows,
        },
    )
    yield Door(
        "Frame",
        part("frame"),
        {},
        {
            "place": [None, 3, "", "bob", "nobody.x", Thing(), "bob."],
            "at": rows,
            "z": [*rows, (0, 0, 0)],
            "x": [*rows[1:], (0, 1, 0)],
        },
    )
    for kind in (Revolute, Prismatic, Cylindrical):
        start = (0.0, 0.0) if kind is Cylindrical else 0.0
        bad = [x for x in parameter() if x is not None]
        yield Door(
            kind.__name__,
            part("joint", kind=kind),
            {"start": start},
            {
                "name": [None, 3, "", "a b", Thing(), []],
                "parent": [None, 3, "nobody", "ground.nothing", Thing(), "bob.pivot"],
                "child": [None, 3, "nobody", "bob.nothing", Thing()],
                "start": [*bad, (0.0, 0.0, 0.0)],
                "rate": [*bad, (0.0, 0.0, 0.0)],
                "friction": [3, "x", LuGre(), LuGre, Thing(), []],
            },
        )
    rub: dict[str, Any] = {"law": Coulomb(), "radius": 0.01}
    yield Door(
        "JointFriction",
        lambda **a: pendulum(joint={"friction": JointFriction(**a)}),
        rub,
        {
            "law": thing(Coulomb),
            "radius": parameter(0.0, -1.0),
            "length": parameter(0.0)[1:],
            "width": parameter(-1.0)[1:],
            "preload": parameter(),
            "normal": parameter(-1.0)[1:],
            "eps": parameter(-1.0),
        },
    )
    springs = {"name": "s", "a": "ground.pivot", "b": "bob.pivot"}
    yield Door(
        "SpringDamper",
        part("force", lambda **a: SpringDamper(**springs | {"stiffness": 1.0} | a)),
        {},
        {
            "name": [None, 3, "", "a b", Thing()],
            "a": [None, 3, "nobody", Thing()],
            "b": [None, 3, "nobody", Thing()],
            "stiffness": parameter(),
            "damping": parameter(),
            "free_length": parameter(),
        },
    )
    yield Door(
        "JointSpringDamper",
        part("force", lambda **a: JointSpringDamper(**{"name": "s", "joint": "hinge"} | a)),
        {},
        {
            "joint": [None, 3, "nobody", Thing()],
            "stiffness": parameter(),
            "damping": parameter(),
            "direction": [3, "up", Thing()],
        },
    )
    yield Door(
        "Gear",
        part(
            "constraint",
            lambda **a: Gear(**{"name": "g", "a": "hinge", "b": "hinge", "ratio": 1.0} | a),
        ),
        {},
        {
            "a": [None, 3, "nobody", Thing()],
            "ratio": parameter(0.0),
        },
    )
    yield Door(
        "PrescribedMotion",
        part(
            "constraint",
            lambda **a: PrescribedMotion(
                **{"name": "p", "joint": "hinge", "motion": lambda t: t} | a
            ),
        ),
        {},
        {
            "joint": [None, 3, "nobody", Thing()],
            "motion": [
                None,
                "x",
                Thing(),
                lambda: 1,
                lambda t: None,
                lambda t: "a",
                lambda t: 1j,
                lambda t: ca.SX.sym("a"),
                lambda t: ca.vertcat(t, t),
                lambda t: NAN,
            ],
        },
    )
    yield Door(
        "Mechanism.input",
        part("input"),
        {},
        {
            "name": [None, 3, "", "a b", Thing()],
            "unit": [None, 3, Thing()],
            "start": number(),
            "nominal": number(0.0, -1.0),
        },
    )
    yield Door(
        "Mechanism.build",
        part("build"),
        {},
        {
            "p": [3, "x", (3,), Thing(), [ca.SX.sym("a")]],
            "formulation": choice(),
            "index": [2, -1, "0", 0.5, Thing(), [0], NAN],
        },
    )
    yield Door(
        "read_urdf",
        lambda **a: read_urdf(**a).build(),
        {"source": URDF},
        {
            "source": [
                None,
                3,
                [],
                Thing(),
                "",
                "<robot",
                "nothing.urdf",
                "<a/>",
                "<robot/>",
                b"x",
            ],
            "law": thing(Coulomb)[1:],
            "level": parameter(-1.0),
            "floating": flag(),
            "bearings": [3, "j", {"k": None}, {"j": 3}, {"j": Coulomb()}, Thing()],
            "gravity": rows[1:],
        },
    )


test_every_door_refuses_bad_input_in_a_sentence = every_door_refuses(
    {
        "mechanisms": doors_of_mechanisms,
    }
)
