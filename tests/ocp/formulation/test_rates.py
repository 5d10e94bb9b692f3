from math import inf

import pytest

from ocp.formulation.expressions import integral
from ocp.formulation.phase import FREE, Phase
from ocp.formulation.problem import Problem
from ocp.formulation.statement import with_parameters, with_rates
from symfric import BrownMcPhee, LuGre, Model, drive, simulate
from symfric.multibody import JointSpringDamper
from symfric.scenes import SliderCrank


def crank() -> Model:
    m = SliderCrank(BrownMcPhee(mu_s=0.2, mu_d=0.15, v_t=0.02), omega=0.0).mechanism()
    torque = m.input("torque", "N m", nominal=10.0)
    m.force(JointSpringDamper("motor", "crank", "turn", actuator=torque))
    return m.build()


@pytest.mark.parametrize(
    ("model", "name"), [(drive(LuGre()), "force"), (crank(), "torque")], ids=["drive", "crank"]
)
def test_ramp_of_an_input_is_a_constant_rate(model: Model, name: str) -> None:
    rated = with_rates(model, {name: 50.0})
    assert [v.name for v in rated.u] == [f"{name}_rate"]
    assert rated.x[-1].symbol is next(v.symbol for v in model.u)
    told = simulate(model, 0.05, u={name: lambda t: 1.0 + 50.0 * t})
    ramp = simulate(rated, 0.05, x0={name: 1.0}, u={f"{name}_rate": 50.0})
    for signal in (*model.signals, *list(model.further)[:2]):
        assert ramp[signal][-1] == pytest.approx(told[signal][-1], rel=1e-5, abs=1e-8)


@pytest.mark.parametrize("model", [drive(BrownMcPhee()), crank()], ids=["drive", "crank"])
def test_contacts_stay_with_the_model(model: Model) -> None:
    """Another law can be put in the place of the one that was there."""
    (name,) = (v.name for v in model.u)
    for changed in (with_rates(model, {name: 1.0}), with_parameters(model, {"goal": "m"})):
        (contact,) = changed.contacts
        other = changed.with_forces({contact.name: 2.0 * contact.slip})
        assert [v.name for v in (*other.x, *other.u)] == [v.name for v in (*changed.x, *changed.u)]
        assert {v.name for v in other.p} == {v.name for v in changed.p}


def test_same_request_gives_the_same_model() -> None:
    model = drive(LuGre())
    assert with_rates(model, {}) is with_parameters(model, {}) is model
    assert with_rates(model, {"force": 2.0}) is with_rates(model, {"force": 2.0})
    assert with_rates(model, {"force": 2.0}) is not with_rates(model, {"force": 3.0})
    assert with_parameters(model, {"goal": "m"}) is with_parameters(model, {"goal": "m"})


def test_input_with_a_rate_starts_anywhere_and_keeps_its_bounds() -> None:
    phase = Phase(drive(BrownMcPhee()), 1.0, end={"force": 0.0}, via={0.5: {"force": (0, 1)}})
    problem = Problem(
        phase >> Phase(phase.model, 1.0),
        integral(lambda s: s.force**2),
        bounds={"force": (-20.0, 20.0)},
        rates={"force": (-400.0, None)},
    )
    first, second = problem.spans
    assert first.model is second.model
    assert first.box("force_rate") == (-400.0, inf)
    assert [first.nodes[s]["force"] for s in (0.0, 0.5, 1.0)] == [(-20, 20), (0, 1), (0, 0)]
    assert [link.state for link in second.links] == ["x", "v", "force"]
    assert first.model.u[0].nominal == 400.0


def test_start_of_an_input_with_a_rate_is_shared_like_the_input() -> None:
    phase = Phase(drive(BrownMcPhee(), free=["mu_d"]), 1.0)
    both = {"scenarios": {"a": {"mu_d": 0.1}, "b": {"mu_d": 0.12}}, "rates": {"force": FREE}}
    cost = integral(lambda s: s.force**2)
    problem = Problem(phase >> phase, cost, shared=["force"], **both)
    assert problem.shared_inputs == ("force_rate",)
    assert problem.shared_starts == ((0, "force"),)
    assert Problem(phase, cost, shared=[], **both).shared_starts == ()
    told = Phase(phase.model, 1.0, start={"force": 0.0})
    assert Problem(told, cost, **both).shared_starts == ()
