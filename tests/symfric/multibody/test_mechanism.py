"""The builder: one error for all mistakes, each with its path; starts, redundancy, sizes."""

from collections.abc import Callable
from dataclasses import replace
from functools import partial
from typing import Any

import casadi as ca
import numpy as np
import pytest
from chains import X, Y, Z, attach, in_joint_coordinates_first, rod
from tables import table

from symfric import BrownMcPhee, LuGre, SolveError, Viscous, simulate
from symfric import multibody as mb
from symfric.foundation.numeric import Scalar
from symfric.foundation.parameters import Variable
from symfric.multibody.prepare import following

LAW = BrownMcPhee()


def test_wrong_masses_loose_bodies_and_open_loops_come_at_once() -> None:
    loose, open_loop = slider_on_a_rod(), slider_on_a_rod(start=0.9)
    for m in (loose, open_loop):
        m.bodies[1] = replace(m.bodies[1], mass=0.0)
    loose.body("bob", 1.0, (1.0, 1.0, 1.0))
    for build, message in (
        (loose.build, r"block_x' > mass(.|\n)*body 'bob': expected joints"),
        (open_loop.build, r"block_x' > mass(.|\n)*near it x = 0\.832"),
        (open_loop.assembled, r"block_x' > mass: [^\n]*$"),  # an open loop is what it is for
        (slider_on_a_rod(start=0.9).build, r"satisfy rod_lambda.*x = 0\.832.*z = 0\.554"),
    ):
        with pytest.raises(ValueError, match=message):
            build()
    x, z, *_ = slider_on_a_rod(start=0.9).assembled().build().initial_state()
    assert (x, z) == pytest.approx(np.array([0.9, 0.6]) / np.hypot(0.9, 0.6), abs=1e-12)


@in_joint_coordinates_first
def test_a_rod_that_holds_what_is_held_already_is_redundant(formulation: str) -> None:
    m = rod()
    m.frame("ground.beside", at=(0.0, 1.0, 0.0))
    m.joint(mb.Distance("stay", "ground.beside", "rod.hinge", length=1.0))
    made = m.prepare(formulation=formulation)
    assert made.redundant == ("stay_lambda",)
    alone = simulate(rod().build(), 0.5, rtol=1e-9)
    assert simulate(m.build(formulation=formulation), 0.5, rtol=1e-9).final["energy"] == (
        pytest.approx(alone.final["energy"], abs=1e-7)
    )


def test_loops_close_for_a_length_that_is_a_parameter() -> None:
    length = Variable("length", "m", start=1.2)
    m = slider_on_a_rod(length=length.symbol)
    with pytest.raises(ValueError, match=r"near it x = 0\.96, z = 0\.72"):
        m.build((length,))
    x, z, *_ = m.assembled((length,)).build((length,)).initial_state()
    assert (x, z) == pytest.approx((0.96, 0.72))


def slider_on_a_rod(start: float = 0.8, length: Scalar = 1.0) -> mb.Mechanism:
    """Two slides at a right angle and a rod of 1 m: x^2 + z^2 = 1."""
    m = mb.Mechanism("ladder")
    attach(m, mb.Prismatic, "x", "block_x", z=X, start=start)
    attach(m, mb.Prismatic, "z", "block_z", z=Z, start=0.6)
    m.joint(mb.Distance("rod", "block_x", "block_z", length=length))
    return m


def test_rates_that_cannot_stay_move_to_the_nearest() -> None:
    J, still = np.array([[0.8, 0.6]]), np.zeros(1)
    assert following(J, np.array([1.0, 1.0]), still) == pytest.approx([0.6 * -0.2, 0.8 * 0.2])
    assert following(J, np.array([1.0, 0.0]), still) == pytest.approx([1.0, -4 / 3])
    assert following(np.array([[1.0, 0.0]]), np.array([1.0, 0.0]), still) == pytest.approx([0, 0])
    fast = np.array([1e3, 0.0])  # a dead centre is one at which the other rate is out of proportion
    assert following(np.array([[1.0, -0.05]]), fast, still) == pytest.approx([1e3, 2e4])
    assert following(J, np.zeros(2), np.array([0.5])) == pytest.approx([-0.4, -0.3])
    twice = np.array([[0.8, 0.6], [1.6, 1.2]])
    assert following(twice, np.array([0.0, 3.0]), np.zeros(2)) == pytest.approx([-9 / 4, 3.0])


def test_loops_that_cannot_be_closed_are_refused() -> None:
    m = slider_on_a_rod()
    m.joint(mb.Distance("long", "ground", "block_x", length=3.0))
    with pytest.raises(ValueError, match="no position near it satisfies them"):
        m.build()
    with pytest.raises(ValueError, match="from which the loops can be closed"):
        m.assembled()


def four_bar(
    last: type[mb.Revolute] | type[mb.PointOnLine], friction: mb.JointFriction | None = None
) -> mb.Mechanism:
    """A parallelogram that stands slanted, its last joint a hinge or a pin."""
    m, up, over = mb.Mechanism("four_bar"), (0.6, 0.0, 0.8), (2.0, 0.0, 0.0)
    attach(m, mb.Revolute, "a", "left", J=0.1, z=Y, friction=friction)
    attach(m, mb.Revolute, "b", "right", J=0.1, at=over, z=Y)
    attach(m, mb.Revolute, "c", "top", "left", J=0.1, at=up, z=Y)
    attach(m, last, "d", "right", "top", at=over, to=up, z=Y)
    return m


def test_redundant_constraints_are_left_out_and_named() -> None:
    hinged, pinned = (four_bar(kind).prepare() for kind in (mb.Revolute, mb.PointOnLine))
    assert len(hinged.redundant) == 3
    assert all(name.startswith("d_lambda") for name in hinged.redundant)
    assert (len(pinned.labels), pinned.redundant) == (2, ())
    runs = [
        simulate(four_bar(kind).build(), 0.5, rtol=1e-9) for kind in (mb.Revolute, mb.PointOnLine)
    ]
    assert runs[0]["a"] == pytest.approx(runs[1]["a"], abs=1e-7)


def test_friction_from_reactions_that_are_not_unique_is_refused() -> None:
    friction = mb.JointFriction(LAW, radius=0.02, length=0.1)
    message = "joint 'a' > friction: expected reactions that the motion"
    with pytest.raises(ValueError, match=message):
        four_bar(mb.Revolute, friction).build()
    assert four_bar(mb.PointOnLine, friction).build().z
    constant = mb.JointFriction(LAW, radius=0.02, normal=50.0)
    assert four_bar(mb.Revolute, constant).build().name == "four_bar"


def test_a_dead_centre_is_refused_as_a_start() -> None:
    with pytest.raises(ValueError, match="start: expected independent constraints, got a singular"):
        dead_centre().build()


def dead_centre() -> mb.Mechanism:
    """Slides at a right angle, the rod along one of them: z and x are not distinguishable."""
    m = mb.Mechanism("dead")
    attach(m, mb.Prismatic, "x", "a", z=X)
    attach(m, mb.Prismatic, "y", "b", at=(1.0, 0.0, 0.0), z=Y)
    m.joint(mb.Distance("rod", "a", "b", length=1.0))
    m.joint(mb.Distance("stay", "ground", "b", length=1.0))
    return m


def test_what_a_joint_does_not_need_is_not_there() -> None:
    sizes, costs = [], list[int]()
    for friction in (
        None, mb.JointFriction(Viscous(), radius=0.1), mb.JointFriction(LAW, radius=0.1, normal=20),
        mb.JointFriction(LAW, radius=0.1), mb.JointFriction(LuGre(), radius=0.1, normal=20.0),
    ):  # fmt: skip
        model = rod(friction).build()
        sizes.append((len(model.x), len(model.z)))
        costs.append(model.function("ode").n_instructions())
    assert sizes == [(2, 0), (2, 0), (2, 0), (2, 1), (3, 0)]
    assert costs[0] < costs[1] < costs[2]


def test_inputs_and_parameters_enter_forces_and_bodies() -> None:
    mass = Variable("mass", "kg", start=2.0)
    m = mb.Mechanism("m", gravity=(0.0, 0.0, 0.0))
    attach(m, mb.Prismatic, "x", "block", mass=mass.symbol)
    m.force(mb.JointSpringDamper("motor", "x", actuator=m.input("force", "N")))
    run = simulate(m.build((mass,)), 2.0, u={"force": 6.0}, p={"mass": 3.0}, rtol=1e-9)
    assert run["x"][-1] == pytest.approx(0.5 * 2.0 * 4.0)


@in_joint_coordinates_first
def test_a_free_body_spins_as_it_must(formulation: str) -> None:
    """Momentum and energy of a tumbling body without forces."""
    m = mb.Mechanism("m", gravity=(0.0, 0.0, 0.0))
    m.body("stone", 2.0, (1.0, 2.0, 2.5))
    rate = tuple(0.5 * w for w in (0.3, 2.0, 0.1))
    m.joint(mb.Floating("pose", "ground", "stone", rate=(1.0, 0.0, 0.0, 0.0, *rate)))
    run = simulate(m.build(formulation=formulation), 5.0, rtol=1e-9)
    assert np.ptp(run["kinetic"]) < 1e-7
    assert run["constraint_position"].max() < 1e-12
    name = "pose" if formulation == "joint" else "stone"
    assert run[f"{name}_x"] == pytest.approx(run.t, abs=1e-9)


def test_a_mechanism_that_falls_into_a_dead_centre_reports_it() -> None:
    """All links of the parallelogram in one line: it may go on as one or folded."""
    with pytest.raises(SolveError, match="the configuration is singular: constraints depend"):
        simulate(four_bar(mb.PointOnLine).build(), 1.0, rtol=1e-9)


J = (1.0, 1.0, 1.0)
Change = Callable[[mb.Mechanism], object]


def body(*numbers: Any, **more: Any) -> Change:
    return lambda m: m.body("bob", *numbers, **more)


def joint(kind: Any, *given: Any, **more: Any) -> Change:
    return lambda m: m.joint(kind(*given, **more))


def force(kind: Any, *given: Any, **more: Any) -> Change:
    return lambda m: m.force(kind(*given, **more))


def of_bob(kind: Any, name: str, parent: str = "rod", **more: Any) -> Change:
    return lambda m: (m.body("bob", 1.0, J), m.joint(kind(name, parent, "bob", **more)))


def drive(name: str, *given: Any) -> Change:
    return lambda m: m.constraint(mb.PrescribedMotion(name, *given))


def coupled(kind: Any, *given: Any) -> Change:
    return lambda m: m.constraint(kind("c", *given))


def held(expression: Callable[[Any], Any]) -> Change:
    return lambda m: m.constraint(mb.UserConstraint("held", expression))


pushed = partial(force, mb.UserForce, "push", "rod")
PIN = ("pin", "rod", "ground")


def test_mistakes_are_described_with_their_path() -> None:
    """Changes of rod() in mistakes.toml."""
    for change, message in table(__file__, "mistakes").items():
        m = rod()
        with pytest.raises(ValueError) as caught:
            eval(change, globals() | {"ca": ca})(m)
            m.build()
        assert message in str(caught.value), change
        assert "mechanism 'rod' > " in str(caught.value) or not message.startswith(">")


def test_mistakes_of_a_mechanism_as_a_whole() -> None:
    for m, message in (
        *(
            (mb.Mechanism(name), "> name: expected a C identifier")
            for name in ("a crank", "", "4bar")
        ),
        (mb.Mechanism("m", gravity=(0.0, -9.81)), "> gravity: expected three numbers [m/s^2]"),
        (mb.Mechanism("m", gravity=(0.0, 0.0, 0.0)), "expected bodies that can move, got none"),
    ):
        m.body("stone", 1.0, J)
        m.joint(mb.Fixed("foot", "ground", "stone"))
        with pytest.raises(ValueError) as caught:
            m.build()
        assert message in str(caught.value)


def test_all_mistakes_come_at_once_and_each_once() -> None:
    m = mb.Mechanism("crank")
    m.body("a", -1.0, J)
    m.body("b", 1.0, (0.0, 1.0, 1.0))
    m.joint(mb.Revolute("slider", "ground", "a", friction=mb.JointFriction(LAW)))
    m.joint(mb.Prismatic("slide", "a", "c"))
    with pytest.raises(ValueError) as caught:
        m.build()
    lines = str(caught.value).splitlines()
    assert len(lines) == 4
    assert all(line.startswith("mechanism 'crank' > ") for line in lines)
    assert any("joint 'slider' > friction" in line for line in lines)


def test_a_list_of_expressions_is_a_column() -> None:
    m = mb.Mechanism("one")
    m.body("b", 1.0, J)
    m.joint(mb.Floating("j", "ground", "b"))
    held(lambda kin: [kin.point("b")[0][1], kin.point("b")[0][2]])(m)
    assert [v.name for v in m.build().z] == ["held_lambda_1", "held_lambda_2", "j_norm"]
    m.bodies[1] = replace(m.bodies[1], mass=0.0)
    with pytest.raises(ValueError, match="formulation: expected one of joint, absolute, got abs"):
        m.build(formulation="abs")
