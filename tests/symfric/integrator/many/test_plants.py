"""Plants in vector lanes: each is equal to the same plant alone."""

import numpy as np
import pytest
from backends import needs_compiler
from differentiable import followed

from symfric import LuGre, Model, Plant, SolveError, Variable, drive, stepper
from symfric.integrator.many.members import LEAST_PLANTS

pytestmark = needs_compiler
x, z, u = Variable("x", "m"), Variable("z", "1"), Variable("u", "N")
MEMBERS = 11
"""No multiple of the number of lanes."""


def batch(model: Model, dt: float, members: int = MEMBERS) -> Plant:
    plant = stepper(model, dt, batch=members, backend="compiled")
    assert ("lanes" in plant._integrator.memory) is (members >= LEAST_PLANTS)
    return plant


@pytest.mark.parametrize("model", [drive(LuGre()), followed()], ids=lambda m: m.name)
def test_each_goes_as_alone_and_in_any_order(model: Model) -> None:
    rng = np.random.default_rng(0)
    held = np.cumsum(rng.normal(size=(10, MEMBERS, 1)), axis=0)
    order = rng.permutation(MEMBERS)
    few = batch(model, 5e-3, 3)
    together, mixed = batch(model, 5e-3), batch(model, 5e-3)
    for forces in held:
        found = together.step(forces)
        np.testing.assert_array_equal(mixed.step(forces[order]), found[order])
        assert few.step(forces[:3]) == pytest.approx(found[:3], rel=1e-6, abs=1e-9)
    assert together.t == pytest.approx(np.full(MEMBERS, 0.05))
    np.testing.assert_array_equal(together.u, held[-1])


def test_distant_unknowns_are_found_and_failures_leave_other_members_unchanged() -> None:
    """No fast update reaches a force of 1e3 N from rest; z^2 = u has no root for u = -1."""
    plant = batch(followed(), 0.1)
    forces = np.zeros((MEMBERS, 1))
    forces[4] = 1e3
    plant.step(forces)
    root = plant["z"][4]
    assert root + root**3 == pytest.approx(1e3 - plant.x[4, 0])
    w, force = Variable("z", "1", start=1.0), Variable("u", "N", start=1.0)
    alg = w.symbol**2 - force.symbol
    none = batch(Model("root", x=(x,), z=(w,), u=(force,), ode=w.symbol, alg=alg), 1.0)
    none.step(np.full((MEMBERS, 1), 4.0))
    forces = np.full((MEMBERS, 1), 9.0)
    forces[7] = -1.0
    with pytest.raises(SolveError, match=r"plant 7: .*no solution of the algebraic"):
        none.step(forces)
    assert [*none.failed] == [7]
    others = np.arange(MEMBERS) != 7
    assert none.x[others, 0] == pytest.approx(np.full(MEMBERS - 1, 5.0))
    assert none.t.tolist() == np.where(others, 2.0, 1.0).tolist()
    none.reset(members=[7])
    assert none.step(np.full((MEMBERS, 1), 1.0))[7] == pytest.approx([1.0])
    with pytest.raises(ValueError, match="expected finite numbers"):
        none.step(np.full((MEMBERS, 1), np.nan))


def test_attempts_are_bounded_for_each() -> None:
    plant = stepper(drive(LuGre()), 1.0, batch=MEMBERS, max_steps=30, backend="compiled")
    forces = np.zeros((MEMBERS, 1))
    forces[2] = 5.0
    with pytest.raises(SolveError, match=r"plant 2: .*maximum number of steps"):
        plant.step(forces)
    assert [*plant.failed] == [2]
    assert plant.attempts <= 30 * MEMBERS
