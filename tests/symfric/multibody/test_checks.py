"""Every mistake of a scene is described with its path, all in one error."""

from collections.abc import Callable

import casadi as ca
import numpy as np
import pytest
from chains import X, rod

from symfric import BrownMcPhee
from symfric.multibody import (
    Distance,
    Fixed,
    Floating,
    JointFriction,
    JointSpringDamper,
    Mechanism,
    PrescribedMotion,
    Prismatic,
    Revolute,
    Spherical,
    SpringDamper,
    Universal,
)

LAW = BrownMcPhee()


def wrong(change: Callable[[Mechanism], object]) -> Mechanism:
    m = rod()
    change(m)
    return m


MISTAKES: dict[str, tuple[Callable[[Mechanism], object], str]] = {
    "zero mass": (
        lambda m: m.body("bob", 0.0, (1.0, 1.0, 1.0)),
        "> body 'bob' > mass: expected > 0 kg, got 0",
    ),
    "indefinite inertia": (
        lambda m: m.body("bob", 1.0, (1.0, 1.0, 1.0, 2.0, 0.0, 0.0)),
        "> body 'bob' > inertia: expected positive principal moments, got -1, 1, 3",
    ),
    "zero inertia": (
        lambda m: m.body("bob", 1.0, (0.0, 0.0, 0.0)),
        "> body 'bob' > inertia: expected positive principal moments, got 0, 0, 0",
    ),
    "impossible inertia": (
        lambda m: m.body("bob", 1.0, (1.0, 1.0, 3.0)),
        "largest principal moment to be at most the sum of the others, got 1, 1, 3",
    ),
    "two numbers of inertia": (
        lambda m: m.body("bob", 1.0, (1.0, 1.0)),
        "> body 'bob' > inertia: expected 3 or 6 numbers [kg m^2], got 2; write (Jxx, Jyy, Jzz)",
    ),
    "no identifier": (
        lambda m: m.body("the bob", 1.0, (1.0, 1.0, 1.0)),
        "> body 'the bob': expected a name that is a C identifier",
    ),
    "twice": (
        lambda m: m.body("hinge", 1.0, (1.0, 1.0, 1.0)),
        "> joint 'hinge': expected every name once",
    ),
    "unknown body": (
        lambda m: m.joint(Fixed("weld", "rodd", "ground")),
        "> joint 'weld': expected a body or 'body.frame', got rodd; did you mean rod?",
    ),
    "unknown frame": (
        lambda m: m.joint(Fixed("weld", "rod.tip", "ground")),
        "> joint 'weld': expected one of the frames hinge, got rod.tip",
    ),
    "one body twice": (
        lambda m: m.joint(Fixed("weld", "rod", "rod.hinge")),
        "> joint 'weld': expected two bodies, got rod twice",
    ),
    "frame of nothing": (
        lambda m: m.frame("bob.tip"),
        "> frame 'bob.tip': expected 'body.frame' of a known body",
    ),
    "force at nothing": (
        lambda m: m.force(SpringDamper("spring", "ground", "bob")),
        "> force 'spring': expected a body or 'body.frame', got bob",
    ),
    "force along nothing": (
        lambda m: m.force(JointSpringDamper("motor", "hing")),
        "> force 'motor': expected a joint, got hing",
    ),
    "turning a slide": (
        lambda m: (
            m.body("block", 1.0, (1.0, 1.0, 1.0)),
            m.joint(Prismatic("rail", "ground", "block")),
            m.force(JointSpringDamper("motor", "rail", "turn")),
        ),
        "> force 'motor' > direction: expected slide, got turn",
    ),
    "one way of several": (
        lambda m: (
            m.body("block", 1.0, (1.0, 1.0, 1.0)),
            m.joint(Universal("cross", "ground", "block")),
            m.force(JointSpringDamper("motor", "cross")),
        ),
        "> force 'motor' > direction: expected x or y, got none",
    ),
    "loose body": (
        lambda m: m.body("bob", 1.0, (1.0, 1.0, 1.0)),
        "> body 'bob': expected joints with coordinates up to the ground, found none; "
        "a Floating joint lets it move freely",
    ),
    "friction of nothing": (
        lambda m: (
            m.body("bob", 1.0, (1.0, 1.0, 1.0)),
            m.joint(Floating("pose", "rod", "bob", friction=JointFriction(LAW))),
        ),
        "> joint 'pose' > friction: expected a joint with friction",
    ),
    "start of another size": (
        lambda m: (
            m.body("bob", 1.0, (1.0, 1.0, 1.0)),
            m.joint(Spherical("ball", "rod", "bob", start=(1.0, 0.0))),
        ),
        "> joint 'ball' > start: expected 4 numbers, got 2",
    ),
    "start that is no number": (
        lambda m: (
            m.body("bob", 1.0, (1.0, 1.0, 1.0)),
            m.joint(Revolute("pin", "rod", "bob", rate=float("nan"))),
        ),
        "> joint 'pin' > rate: expected finite numbers, got nan",
    ),
    "a mass that is no number": (
        lambda m: m.body("bob", "1", (1.0, 1.0, 1.0)),
        "> body 'bob' > mass: expected a number [kg], got '1'",
    ),
    "an inertia as a matrix": (
        lambda m: m.body("bob", 1.0, np.eye(3)),  # type: ignore[arg-type]
        "> body 'bob' > inertia: expected 3 or 6 numbers",
    ),
    "a mass nobody declared": (
        lambda m: m.body("bob", ca.SX.sym("load"), (1.0, 1.0, 1.0)),
        "> body 'bob': expected only declared parameters, got load; pass the variable, build",
    ),
    "a spring whose places coincide": (
        lambda m: m.force(SpringDamper("spring", "ground.hinge", "rod.hinge", 1.0, 0.1)),
        "> force 'spring': expected a finite force at the start, got nan; do its places coincide",
    ),
    "a joint without its body": (
        lambda m: m.joint(Fixed("weld", "", "ground")),
        "> joint 'weld': expected a body or 'body.frame', got ",
    ),
    "a torque nobody declared": (
        lambda m: m.force(JointSpringDamper("motor", "hinge", actuator=ca.SX.sym("torque"))),
        "> force 'motor': expected only declared positions, velocities, time, parameters and "
        "inputs, got torque",
    ),
    "a radius nobody declared": (
        lambda m: m.joint(
            Revolute("pin", "rod", "ground", friction=JointFriction(LAW, radius=ca.SX.sym("R")))
        ),
        "> joint 'pin' > friction: expected only declared parameters and inputs, got R",
    ),
    "stiffness that is no number": (
        lambda m: m.force(SpringDamper("spring", "ground", "rod", stiffness=float("nan"))),
        "> force 'spring' > stiffness: expected a finite number, got nan",
    ),
    "a law for a joint": (
        lambda m: m.joint(Revolute("pin", "rod", "ground", friction=LAW)),  # type: ignore[arg-type]
        "> joint 'pin' > friction: expected JointFriction(law, radius=...), got BrownMcPhee",
    ),
    "a rod without length": (
        lambda m: m.joint(Distance("stay", "ground", "rod", length=0.0)),
        "> joint 'stay' > length: expected > 0 m, got 0.0",
    ),
    "a rod that can never fit": (
        lambda m: m.joint(Distance("stay", "ground.hinge", "rod.hinge", length=2.0)),
        "> start: expected positions that satisfy stay_lambda, got -2; no position near it satis",
    ),
    "a frame without direction": (
        lambda m: m.frame("rod.tip", z=(0.0, 0.0, 0.0)),
        "> frame 'rod.tip' > z: expected three numbers that are not all zero",
    ),
    "a frame twice": (
        lambda m: m.frame("rod.hinge", z=X),
        "> frame 'rod.hinge': expected every name once",
    ),
    "an input like a joint": (
        lambda m: m.input("hinge", "N"),
        "> input 'hinge': expected every name once",
    ),
    "motion that is no function": (
        lambda m: m.constraint(PrescribedMotion("drive", "hinge", 0.3)),  # type: ignore[arg-type]
        "> drive 'drive' > motion: expected a function of time, got 0.3",
    ),
    "what is no joint": (
        lambda m: m.joint("hinge"),  # type: ignore[arg-type]
        "> joint: expected a Joint of symfric.multibody, got 'hinge'",
    ),
}


@pytest.mark.parametrize("name", MISTAKES)
def test_mistakes_are_described_with_their_path(name: str) -> None:
    change, message = MISTAKES[name]
    with pytest.raises(ValueError) as caught:
        wrong(change).build()
    assert "mechanism 'rod' > " in str(caught.value)
    assert message in str(caught.value)


def test_all_mistakes_come_at_once() -> None:
    m = Mechanism("crank")
    m.body("a", -1.0, (1.0, 1.0, 1.0))
    m.body("b", 1.0, (0.0, 1.0, 1.0))
    m.joint(Revolute("slider", "ground", "a", friction=JointFriction(LAW)))
    m.joint(Prismatic("slide", "a", "c"))
    with pytest.raises(ValueError) as caught:
        m.build()
    lines = str(caught.value).splitlines()
    assert len(lines) == 4
    assert all(line.startswith("mechanism 'crank' > ") for line in lines)
    assert any("joint 'slider' > friction" in line for line in lines)


def test_the_same_mistake_is_said_once() -> None:
    m = wrong(lambda m: (m.body("bob", 1.0, (1, 1, 1)), m.body("bob", 1.0, (1, 1, 1))))
    with pytest.raises(ValueError) as caught:
        m.build()
    assert str(caught.value) == "mechanism 'rod' > body 'bob': expected every name once"
