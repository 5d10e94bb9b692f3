"""Costs as counts: a table that is checked in, and options that cost nothing while switched off."""

import json
from dataclasses import asdict
from pathlib import Path

import pytest
from law_cases import CASES

from symfric import ALL_LAWS, Coulomb, Viscous
from symfric.laws import BAM, POPULATIONS
from symfric.laws.composed.populations import cost

TABLE = Path(__file__).parents[2] / "golden" / "instructions.json"


def counted() -> dict[str, dict[str, int]]:
    return {name: asdict(cost(kind())) for name, kind in (ALL_LAWS | POPULATIONS).items()}


def test_instructions_of_every_law_are_those_of_the_table(request: pytest.FixtureRequest) -> None:
    found = counted()
    if request.config.getoption("--update-golden"):
        TABLE.parent.mkdir(exist_ok=True)
        lines = (f"  {json.dumps(name)}: {json.dumps(counts)}" for name, counts in found.items())
        TABLE.write_text("{\n" + ",\n".join(lines) + "\n}\n", encoding="utf-8")
    table = json.loads(TABLE.read_text(encoding="utf-8"))
    differing = {name: (table.get(name), found.get(name)) for name in {*table, *found}}
    differing = {name: pair for name, pair in differing.items() if pair[0] != pair[1]}
    assert not differing, "table, found; if intended: pytest --update-golden, and say why"


def test_viscous_friction_is_counted_by_hand() -> None:
    """Value: v, the constant, their product, the output; gradient: the constant and its output."""
    assert asdict(cost(Viscous())) == {"value": 4, "gradient": 2}


@pytest.mark.parametrize("name", CASES)
def test_gradient_costs_a_small_multiple_of_the_value(name: str) -> None:
    """Derivatives by n inputs of m results, each at most a few times the value."""
    law, found = CASES[name], cost(CASES[name])
    directions = 2 + len(law.states) + len(law.inputs)
    assert found.gradient <= 2 * directions * found.value


def test_absent_terms_leave_no_trace() -> None:
    m1 = BAM(K_s=0.0, K_e=0.0, K_m=0.0, K_es=0.0, K_ms=0.0)
    assert m1.inputs == ()
    assert cost(m1).value < cost(BAM()).value < cost(BAM(Q_e=0.01)).value
    assert cost(Coulomb(v_eps=0.0)).value < cost(Coulomb()).value
