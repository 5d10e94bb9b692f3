"""The sketch of a mechanism: places where they are, and the right mark between them."""

import numpy as np
import pytest

from symfric import BrownMcPhee, simulate
from symfric.model.sketch import Sketch
from symfric.multibody import Distance, Mechanism, Planar, Revolute, SpringDamper
from symfric.scenes import MECHANISMS, FourMass, Pendulum

LAW = BrownMcPhee(v_t=0.05)


def sketch(m: Mechanism) -> Sketch:
    made = m.build().sketch
    assert made is not None
    return made()


def test_every_body_and_joint_is_in_it() -> None:
    for scene in MECHANISMS.values():
        mechanism = scene(LAW).mechanism()
        drawn = sketch(mechanism)
        assert {part.name for part in drawn.parts} == {b.name for b in mechanism.bodies}
        springs = [f.name for f in mechanism.forces if isinstance(f, SpringDamper)]
        assert [mark.name for mark in drawn.marks] == [
            *(j.name for j in mechanism.joints),
            *springs,
        ]
        assert drawn.places.shape[0] == 12


def test_places_follow_the_motion_and_the_parameters_of_the_run() -> None:
    """The hinge stays, the bob is where angle and length say."""
    model = Pendulum(LAW).model(["L"])
    run = simulate(model, 1.0, p={"L": 0.7}, samples=5)
    assert model.sketch is not None
    drawn = model.sketch()
    rod = next(part for part in drawn.parts if part.name == "rod")
    bob = run.of(drawn.places[9:, rod.centre])
    angle = run["phi"]
    expected = np.stack([0.7 * np.sin(angle), 0 * angle, -0.7 * np.cos(angle)])
    assert bob == pytest.approx(expected)
    assert run.of(drawn.places[9:, drawn.marks[0].b]) == pytest.approx(np.zeros((3, 5)))
    axes = run.of(drawn.places[:9, drawn.marks[0].b]).T.reshape(-1, 3, 3)
    assert axes @ axes.transpose(0, 2, 1) == pytest.approx(np.tile(np.eye(3), (5, 1, 1)))


def test_ends_of_springs_alone_are_told_from_frames_and_contacts_have_a_scale() -> None:
    drawn = sketch(FourMass(LAW).mechanism())
    parts, marks = ({one.name: one for one in group} for group in (drawn.parts, drawn.marks))
    assert (len(parts["slider_4"].ends), parts["slider_1"].ends) == (1, ())
    assert parts["ground"].fixed and not parts["slider_1"].fixed
    assert marks["y2"].slips == (("y2_slip", 0.05),)
    assert marks["rod_12"].slips == ()


def test_springs_dampers_and_rods_are_told_apart() -> None:
    m = Mechanism("m")
    m.body("bob", 1.0, (0.1, 0.1, 0.1))
    m.frame("ground.wall", at=(1.0, 0.0, 0.0))
    m.joint(Planar("plane", "ground", "bob", start=(0.0, 0.3, 0.0)))
    m.joint(Distance("rod", "ground", "bob", length=0.3))
    m.force(SpringDamper("spring", "ground.wall", "bob", stiffness=1.0))
    m.force(SpringDamper("oil", "ground.wall", "bob", damping=1.0))
    lines = {mark.name: mark.symbol.line for mark in sketch(m).marks}
    assert lines == {"plane": "", "rod": "rod", "spring": "spring", "oil": "damper"}


def test_joints_on_the_ground_are_known_whichever_way_they_are_written() -> None:
    m = Mechanism("m")
    for name, ends in (("one", ("ground", "one")), ("two", ("two", "ground"))):
        m.body(name, 1.0, (0.1, 0.1, 0.1))
        m.joint(Revolute(f"of_{name}", *ends))
    drawn = sketch(m)
    assert [mark.grounded for mark in drawn.marks] == [True, True]
    fixed = next(part for part in drawn.parts if part.fixed)
    assert {mark.a for mark in drawn.marks} <= {*fixed.corners}
