"""Whatever fails on the way to modes ends in the smooth or the sharpened motion, which says so."""

from collections.abc import Callable, Iterator
from math import pi

import casadi as ca
import pytest

from ocp import strategies
from ocp.formulation.expressions import integral
from ocp.formulation.phase import Phase
from ocp.formulation.problem import Problem
from ocp.friction.homotopy import FINE
from ocp.friction.mode_models import holding, mode_model
from ocp.problems import out_and_back
from ocp.solve import solve
from symfric import BrownMcPhee, ExactCoulomb, SolveError, Status
from symfric.laws import Law
from symfric.multibody import JointFriction, JointSpringDamper, Mechanism, Prismatic, Revolute

FAILURES = (
    RuntimeError("variables [z] are free"),
    SolveError("no unique mode", Status.SOLVER_FAILED),
)


def raising(error: Exception) -> Callable[..., object]:
    def fails(*_: object, **__: object) -> object:
        raise error

    return fails


@pytest.mark.parametrize("error", FAILURES, ids=lambda error: type(error).__name__)
def test_a_failure_among_modes_ends_in_the_sharpened_motion(
    error: Exception, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(strategies, "optimise_modes", raising(error))
    found = solve(out_and_back(v_t=1e-5), starts=1)
    assert found.verified
    assert found.modes == {}
    assert "Friction is still smooth: guide over" in found.message
    assert "Modes were not found: " in found.message
    assert str(error) in found.message


def test_a_failure_of_layers_ends_in_the_smooth_motion(monkeypatch: pytest.MonkeyPatch) -> None:
    def layers(*_: object, **__: object) -> Iterator[object]:
        yield raising(RuntimeError("variables [z] are free"))()

    monkeypatch.setattr(strategies, "sharpened", layers)
    found = solve(out_and_back(v_t=0.05), throw=False, intervals=FINE)
    assert found.verified
    assert "Friction was not sharpened: internal error, RuntimeError: variables" in found.message


def test_a_failure_of_exact_friction_is_said(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(
        strategies, "verify_exactly", raising(ValueError("expected no events, got 1"))
    )
    found = solve(out_and_back(v_t=1e-5), starts=1)
    assert found.verified
    assert found.modes
    assert "With exact Coulomb friction it was not simulated: expected no events" in found.message


def test_a_failure_of_verification_is_said(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(strategies, "verified", raising(RuntimeError("variables [z] are free")))
    found = solve(out_and_back(v_t=0.05), throw=False, intervals=20, friction="smooth")
    assert found.ok and not found.verified
    assert "It was not verified: internal error, RuntimeError: variables" in found.message


def test_ctrl_c_passes(monkeypatch: pytest.MonkeyPatch) -> None:
    def stopped(*_: object, **__: object) -> object:
        raise KeyboardInterrupt

    monkeypatch.setattr(strategies, "optimise_modes", stopped)
    with pytest.raises(KeyboardInterrupt):
        solve(out_and_back(v_t=1e-5), starts=1)


def test_a_guess_that_is_none_is_still_refused() -> None:
    with pytest.raises(ValueError, match="guess"):
        solve(out_and_back(v_t=1e-5), guess={"nothing": 1.0}, throw=False)


def cart_pole(law: Callable[[float, float], Law]) -> Problem:
    """1 kg on a rail and 0.3 kg on a rod of 0.5 m, friction in both joints: swing up, 0.8 m on."""
    m = Mechanism("cart_pole", gravity=(0.0, 0.0, -9.81))
    m.body("cart", 1.0, (1e-6,) * 3)
    m.body("bob", 0.3, (1e-6,) * 3)
    for frame in ("ground.rail", "cart.rail"):
        m.frame(frame, z=(1.0, 0.0, 0.0), x=(0.0, 0.0, 1.0))
    m.frame("cart.h", z=(0.0, -1.0, 0.0), x=(0.0, 0.0, -1.0))
    m.frame("bob.h", at=(0.0, 0.0, 0.5), z=(0.0, -1.0, 0.0), x=(0.0, 0.0, -1.0))
    rail = JointFriction(law(2.2, 1.5), normal=1.0)
    pin = JointFriction(law(0.03, 0.02), radius=1.0, normal=1.0)
    m.joint(Prismatic("x", "ground.rail", "cart.rail", friction=rail))
    m.joint(Revolute("th", "cart.h", "bob.h", friction=pin))
    force = m.input("force", "N", nominal=10.0)
    m.force(JointSpringDamper("motor", "x", "slide", actuator=force))
    start = dict.fromkeys(("x", "th", "x_rate", "th_rate"), 0.0)
    move = Phase(m.build(), 2.0, start=start, end=start | {"x": 0.8, "th": pi})
    return Problem(move, integral(lambda s: s.force**2), bounds={"force": (-20.0, 20.0)})


def narrow(mu_s: float, mu_d: float) -> Law:
    return BrownMcPhee(mu_s=mu_s, mu_d=mu_d, v_t=1e-5)


def test_what_would_hold_one_joint_is_written_in_the_reaction_of_the_other() -> None:
    model = cart_pole(narrow).chain[0].model
    modes = {"x": 1, "th": 0}
    moving = mode_model(model, modes)
    force, rooms = holding(model, modes, "x")
    known = [moving.t, *(moving.vector(letter) for letter in "xzup")]
    assert not ca.Function("held", known, [force, *rooms.values()], {"allow_free": True}).has_free()


@pytest.mark.slow
@pytest.mark.parametrize("law", [narrow, lambda s, d: ExactCoulomb(mu_s=s, mu_d=d)])
def test_two_joints_of_a_cart_pole_rub(law: Callable[[float, float], Law]) -> None:
    """Both laws tend to the same friction: 73.8 N^2 s to three digits."""
    found = solve(cart_pole(law))
    assert found.verified
    assert found.cost == pytest.approx(73.8, abs=0.1)
    assert set(found.modes) == {"x", "th"}
    assert "With exact Coulomb friction it misses by" in found.message
