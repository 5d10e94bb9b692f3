"""What a mechanism does not have costs nothing: counts of the model and of its step."""

from dataclasses import replace
from functools import cache

import casadi as ca
import numpy as np
import pytest

from symfric import BrownMcPhee, Model
from symfric.integrator.equations.inputs import input_data
from symfric.integrator.equations.system import system
from symfric.integrator.methods.tableaux import METHODS
from symfric.integrator.step.attempt import build_step
from symfric.multibody import JointFriction, Mechanism
from symfric.scenes import FourBar, FourMass

LAW = BrownMcPhee(v_t=0.01)


def four_mass(joints: str = "", friction: JointFriction | None = None) -> Mechanism:
    """The four-mass system with friction in the joints named, that of the scene by default."""
    m = FourMass(LAW).mechanism()
    m.joints = [
        replace(j, friction=None if j.name not in joints.split() else friction or j.friction)
        for j in m.joints
    ]
    return m


ALL = "x1 y2 z3 x4"
VARIANTS: dict[str, Mechanism] = {
    "none": four_mass(),
    "constant": four_mass(ALL, JointFriction(LAW, normal=50.0)),
    "one": four_mass("x1"),
    "all": four_mass(ALL),
}


def step(model: Model) -> ca.Function:
    return build_step(system(model, input_data(model, None, 0.0, 1.0)), METHODS["rodas5p"])


@cache
def counts(name: str) -> tuple[int, int, int]:
    model = VARIANTS[name].build()
    return len(model.x), len(model.z), step(model).n_instructions()


def test_unknowns_are_those_that_are_needed() -> None:
    """Two multipliers of the rods; x4 carries its weight only, whatever friction does."""
    sizes = {name: counts(name)[:2] for name in VARIANTS}
    assert sizes == {"none": (8, 2), "constant": (8, 2), "one": (8, 3), "all": (8, 5)}


def test_operations_grow_with_what_is_asked_for() -> None:
    none, constant, one, every = (counts(name)[2] for name in VARIANTS)
    assert none < one < every < 2 * none
    assert none < constant < every


@pytest.mark.parametrize("formulation", ["joint", "absolute"])
def test_explicit_accelerations_satisfy_the_implicit_equations(formulation: str) -> None:
    """Closed-form inverse and factors of the mass matrix, against the balance of forces."""
    model = VARIANTS["all"].build(formulation=formulation)
    mechanics = model.holonomic
    assert mechanics is not None
    assert model.ode is not None
    n, x, z = mechanics.n, model.vector("x"), model.vector("z")
    left = ca.substitute(mechanics.implicit[:n], mechanics.a, model.ode[n : 2 * n])
    start = model.initial_state()
    values = ca.Function("left", [x, z], [left])(
        start, np.random.default_rng(0).normal(size=z.numel())
    )
    assert np.abs(values.full()).max() < 1e-11


def test_guesses_are_those_without_friction() -> None:
    model = VARIANTS["one"].build()
    starts = {v.name: v.start for v in model.z}
    bare = {v.name: v.start for v in VARIANTS["none"].build().z}
    assert starts["rod_12_lambda"] == pytest.approx(bare["rod_12_lambda"])
    assert starts["x1_N"] > 0
    assert next(v for v in model.z if v.name == "x1_N").doc.endswith("'x1' with BrownMcPhee")


def test_every_contact_is_watched_on_the_scale_of_its_law() -> None:
    assert [m.nominal for m in VARIANTS["all"].build().monitors] == [0.01] * 4
    assert VARIANTS["none"].build().monitors == ()


def test_a_mechanism_has_one_source_of_its_equations() -> None:
    # `simulate` read `holonomic` and `ocp` read `ode`: zeros put there moved one and not the other
    model = FourBar(BrownMcPhee()).model()
    for part in ("ode", "alg"):
        with pytest.raises(ValueError, match=rf"{part}: expected none with `holonomic`"):
            replace(model, **{part: ca.SX.zeros(getattr(model, part).shape)})
    more = replace(model, outputs={})
    assert ca.is_equal(more.ode, model.ode)
    assert ca.is_equal(more.alg, model.alg)
    heavier = replace(model.holonomic, implicit=2.0 * model.holonomic.implicit)
    with pytest.raises(ValueError, match="ode: expected none"):
        replace(model, holonomic=heavier)
    n, nz = model.holonomic.n, len(model.z)
    again = replace(model, holonomic=heavier, ode=None, alg=ca.SX(0, 1))
    assert (again.ode.numel(), again.alg.numel()) == (2 * n, nz)
