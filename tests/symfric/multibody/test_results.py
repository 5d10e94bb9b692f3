"""Results on request, and sketches, against statics and closed forms."""

from dataclasses import replace
from math import cos, sin

import casadi as ca
import numpy as np
import pytest
from chains import TREE, X, Y, Z, attach, chain, in_both, solve, state

from symfric import BrownMcPhee, simulate
from symfric import multibody as mb
from symfric.integrator.equations.initial import consistent
from symfric.integrator.equations.inputs import input_data
from symfric.integrator.equations.system import system
from symfric.model import Model
from symfric.model.sketch import Sketch
from symfric.multibody.joint import COMPONENTS
from symfric.multibody.results import constraint_units
from symfric.scenes import MECHANISMS, FourBar, FourMass, Pendulum, SliderCrank

pytestmark = pytest.mark.heavy

LAW = BrownMcPhee(v_t=0.5)


def at_start(model: Model) -> dict[str, float]:
    """All details at the start."""
    mechanics = model.holonomic
    assert mechanics is not None
    nx, n = len(model.x), mechanics.n
    made = system(model, input_data(model, None, 0.0, 1.0))
    y = np.zeros(made.n)
    y[:nx] = model.initial_state()
    y[nx + n : nx + n + len(model.z)] = [v.start for v in model.z]
    y = consistent(made, "start", y, model.values("u"))
    names = list(model.further)
    column = ca.vertcat(*(model.expression(name) for name in names))
    arguments = [model.t, *(model.vector(letter) for letter in "xzu")]
    values = ca.Function("details", arguments, [column])
    found = values(0.0, y[:nx], y[nx + n : nx + n + len(model.z)], model.values("u"))
    return dict(zip(names, found.full().ravel().tolist(), strict=True))


def pendulum(angle: float, rate: float) -> mb.Mechanism:
    m = mb.Mechanism("pendulum")
    attach(m, mb.Revolute, "hinge", "bob", mass=2.0, J=(0.1, 0.2, 0.3), to=(0.0, 0.0, 0.4), z=Y,
           x=(0.0, 0.0, -1.0), start=angle, rate=rate)  # fmt: skip
    return m


@pytest.mark.parametrize("angle", [0.7, -2.0])
def test_hinge_of_a_pendulum_pulls_with_weight_and_centrifugal_force(angle: float) -> None:
    """Along the rod m g cos + m L w^2, across it the weight that does not accelerate the bob."""
    m, L, J, g, w = 2.0, 0.4, 0.2, 9.81, 3.0
    found = at_start(pendulum(angle, w).build())
    alpha = -m * g * L * sin(angle) / (J + m * L * L)
    assert found["hinge_Fx"] == pytest.approx(-(m * g * cos(angle) + m * L * w * w))
    assert abs(found["hinge_Fy"]) == pytest.approx(abs(m * L * alpha + m * g * sin(angle)))
    assert [found[f"hinge_{c}"] for c in ("Fz", "Mx", "My")] == pytest.approx([0, 0, 0], abs=1e-9)
    assert "hinge_Mz" not in found
    assert [found["bob_x"], found["bob_z"]] == pytest.approx([-L * sin(angle), -L * cos(angle)])
    velocity = [-L * w * cos(angle), 0.0, L * w * sin(angle)]
    assert [found[f"bob_v{axis}"] for axis in "xyz"] == pytest.approx(velocity)


@in_both
def test_clamped_beam_carries_weight_and_moment(formulation: str) -> None:
    """A cantilever of 3 kg that reaches 0.5 m beyond its clamp, pushed sideways with 7 N."""
    m = mb.Mechanism("beam")
    attach(m, mb.Fixed, "clamp", "beam", mass=3.0, to=(-0.5, 0.0, 0.0))
    m.force(mb.UserForce("push", "beam", lambda kin: ((0.0, 7.0, 0.0), (0.0, 0.0, 0.0))))
    attach(m, mb.Prismatic, "lift", "weight")  # something that moves
    found = at_start(m.build(formulation=formulation))
    wrench = [found[f"clamp_{c}"] for c in COMPONENTS]
    expected = [0.0, -7.0, 3 * 9.81, 0.0, -0.5 * 3 * 9.81, -0.5 * 7.0]
    assert wrench == pytest.approx(expected, abs=1e-9)


def test_guide_takes_what_does_not_point_along_it() -> None:
    """A slider on x under its weight and a force that acts 0.2 m above the guide."""
    m = mb.Mechanism("guide")
    attach(m, mb.Prismatic, "x", "slider", mass=4.0, z=X, x=Z)
    m.frame("slider.top", at=(0.0, 0.0, 0.2))
    m.force(mb.UserForce("pull", "slider.top", lambda kin: ((8.0, 3.0, 0.0), (0.0, 0.0, 0.0))))
    found = at_start(m.build())
    # frame: x up, y = z x x = -y of the world
    assert found["x_Fx"] == pytest.approx(4 * 9.81)
    assert found["x_Fy"] == pytest.approx(3.0)
    assert found["x_Mx"] == pytest.approx(0.0, abs=1e-9)
    assert found["x_My"] == pytest.approx(0.2 * 8.0)
    assert found["x_Mz"] == pytest.approx(0.2 * 3.0)


def test_rod_is_pulled_or_pressed() -> None:
    for start, tension in ((-1.5, 19.62), (1.5, -19.62)):
        m = mb.Mechanism("rod")
        attach(m, mb.Prismatic, "lift", "bob", mass=2.0, start=start)
        m.joint(mb.Distance("rod", "ground", "bob", length=1.5))
        found = at_start(m.build())
        assert found["rod_tension"] == pytest.approx(tension)
        assert [found[f"rod_F{c}"] for c in "xyz"] == pytest.approx([0, 0, 2 * 9.81])


def test_components_left_out_are_those_a_joint_cannot_transmit() -> None:
    made = chain().prepare()
    reactions = solve(made.eq, *state(made)).reactions
    for i, kind in enumerate(TREE):
        values, given = reactions[f"j{i}"], [c in kind.transmits for c in COMPONENTS]
        large = np.abs(values) > 1e-9 * np.abs(values).max(initial=1.0)
        assert large.tolist() == given, kind


def test_details_cost_the_model_nothing_unless_requested(monkeypatch: pytest.MonkeyPatch) -> None:
    calls: list[str] = []
    monkeypatch.setattr("symfric.multibody.results._reactions", lambda *_: calls.append("r") or ())
    model = FourMass(LAW).model()
    run = simulate(model, 0.01)
    assert not {n for n in model.signals if n.endswith(("_Fx", "_work_rate", "_vx"))}
    assert run["energy"].size and not calls
    assert run["slider_1_x"][0] == pytest.approx(4.0)
    assert calls == ["r"]


def test_reactions_that_redundant_constraints_leave_open_are_not_given() -> None:
    """A door on two hinges: who carries how much is not determined."""
    m = mb.Mechanism("door")
    for name, height in (("low", 0.2), ("high", 1.8)):
        ends = {"at": (0.0, 0.0, height), "to": (-0.4, 0.0, height)}
        attach(m, mb.Revolute, name, "door", mass=10.0, **ends)
    attach(m, mb.Revolute, "own", "bob")
    found = at_start(m.build())
    assert [n for n in found if n.startswith(("low_", "high_"))] == ["low_acc"]
    assert found["own_Fz"] == pytest.approx(9.81)


def powers(m: mb.Mechanism) -> set[str]:
    names = m.build().further
    return {n.removesuffix("_work_rate") for n in names if n.endswith("_work_rate")}


def test_only_what_is_not_conserved_has_a_power() -> None:
    m = pendulum(0.3, 0.0)
    m.force(mb.JointSpringDamper("torsion", "hinge", stiffness=3.0))
    m.force(mb.SpringDamper("spring", "ground", "bob", stiffness=2.0, free_length=0.1))
    assert powers(m) == set()
    m.force(mb.JointSpringDamper("damper", "hinge", damping=0.1))
    m.force(mb.SpringDamper("winch", "ground", "bob", actuator=m.input("pull", "N")))
    m.joints[0] = replace(m.joints[0], friction=mb.JointFriction(LAW, radius=0.1))
    # who winds a spring up is not in the model, so that its potential is none
    m.force(mb.JointSpringDamper("wound", "hinge", stiffness=3.0, rest=m.input("rest", "rad")))
    assert powers(m) == {"damper", "winch", "friction", "wound"}


def test_multipliers_have_the_unit_of_what_they_do() -> None:
    rod = SliderCrank(BrownMcPhee()).model().signals
    assert rod["rod_lambda"] == "N/m"
    assert rod["constraint_position"] == "m^2"
    assert rod["constraint_acceleration"] == "m^2/s^2"
    pin = FourBar(BrownMcPhee()).model().signals
    assert pin["pin_lambda_1"] == pin["pin_lambda_2"] == "N"
    assert pin["constraint_velocity"] == "m/s"
    every = FourBar(BrownMcPhee()).mechanism().build(formulation="absolute").signals
    hinge = [every[f"theta_crank_lambda_{i}"] for i in range(1, 6)]
    assert hinge == ["N", "N", "N", "N m", "N m"]
    assert every["crank_rod_norm"] == "J"


def test_constraints_of_several_kinds_have_a_norm_without_unit() -> None:
    assert constraint_units(["N m", "N m"]) == ("rad", "rad/s", "rad/s^2")
    for units in (["N", "N m"], [""], []):
        assert constraint_units(units) == ("", "", "")


SLOW = BrownMcPhee(v_t=0.05)


def sketch(m: mb.Mechanism) -> Sketch:
    made = m.build().sketch
    assert made is not None
    return made()


def test_every_body_and_joint_is_in_it() -> None:
    for scene in MECHANISMS.values():
        mechanism = scene(SLOW).mechanism()
        drawn = sketch(mechanism)
        assert {part.name for part in drawn.parts} == {b.name for b in mechanism.bodies}
        springs = [f.name for f in mechanism.forces if isinstance(f, mb.SpringDamper)]
        assert [mark.name for mark in drawn.marks] == [
            *(j.name for j in mechanism.joints),
            *springs,
        ]
        assert drawn.places.shape[0] == 12


def test_places_follow_the_motion_and_the_parameters_of_the_run() -> None:
    """The hinge stays, the bob is where angle and length say."""
    model = Pendulum(SLOW).model(["L"])
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


def test_ends_of_springs_are_distinguished_from_frames_and_contacts_have_a_scale() -> None:
    drawn = sketch(FourMass(SLOW).mechanism())
    parts, marks = ({one.name: one for one in group} for group in (drawn.parts, drawn.marks))
    assert (len(parts["slider_4"].ends), parts["slider_1"].ends) == (1, ())
    assert parts["ground"].fixed and not parts["slider_1"].fixed
    assert marks["y2"].slips == (("y2_slip", 0.05),)
    assert marks["rod_12"].slips == ()


def test_springs_dampers_and_rods_are_distinguished() -> None:
    m = mb.Mechanism("m")
    m.body("bob", 1.0, (0.1, 0.1, 0.1))
    m.frame("ground.wall", at=(1.0, 0.0, 0.0))
    m.joint(mb.Planar("plane", "ground", "bob", start=(0.0, 0.3, 0.0)))
    m.joint(mb.Distance("rod", "ground", "bob", length=0.3))
    m.force(mb.SpringDamper("spring", "ground.wall", "bob", stiffness=1.0))
    m.force(mb.SpringDamper("oil", "ground.wall", "bob", damping=1.0))
    lines = {mark.name: mark.symbol.line for mark in sketch(m).marks}
    assert lines == {"plane": "", "rod": "rod", "spring": "spring", "oil": "damper"}


def test_joints_on_the_ground_are_known_whichever_way_they_are_written() -> None:
    m = mb.Mechanism("m")
    for name, ends in (("one", ("ground", "one")), ("two", ("two", "ground"))):
        m.body(name, 1.0, (0.1, 0.1, 0.1))
        m.joint(mb.Revolute(f"of_{name}", *ends))
    drawn = sketch(m)
    assert [mark.grounded for mark in drawn.marks] == [True, True]
    fixed = next(part for part in drawn.parts if part.fixed)
    assert {mark.a for mark in drawn.marks} <= {*fixed.corners}
