"""Signals of mechanisms are sorted by what they are."""

from symfric import BrownMcPhee, LuGre, rabinowicz
from symfric.results.kinds import friction_laws, is_mechanism, kinds, norms
from symfric.scenes import FourMass, Pendulum


def test_every_kind_of_a_mechanism_with_loops_and_bristles() -> None:
    model = FourMass(LuGre()).model()
    found = kinds(model)
    assert {kind: sum(k == kind for k in found.values()) for kind in found.values()} == {
        "position": 4,
        "rate": 4,
        "state of friction": 4,
        "normal force": 4,
        "friction": 8,
        "energy": 3,
        "constraints": 3,
    }
    assert set(model.signals) - set(found) == {
        "rod_12_lambda", "rod_23_lambda", "x1_slip", "y2_slip", "z3_slip", "x4_slip"
    }  # fmt: skip


def test_without_loops_there_are_no_norms_of_constraints() -> None:
    model = Pendulum(BrownMcPhee()).model()
    assert norms(model) == ()
    assert friction_laws(model) == "BrownMcPhee"
    assert kinds(model)["phi"] == "position"


def test_mechanisms_are_told_from_other_models() -> None:
    assert is_mechanism(Pendulum(BrownMcPhee()).model())
    assert not is_mechanism(rabinowicz(BrownMcPhee()))
