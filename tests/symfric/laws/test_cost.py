"""Costs as counts: a table that is checked in, and options that cost nothing while switched off."""

import json
from dataclasses import asdict
from pathlib import Path

import casadi as ca
import pytest
from law_cases import CASES, state_symbols
from tables import table

import symfric as sf
from symfric.laws.composed.populations import cost

TABLE = Path(__file__).parents[2] / "golden" / "instructions.json"


def test_instructions_of_every_law_are_those_of_the_table(request: pytest.FixtureRequest) -> None:
    found = {name: asdict(cost(kind())) for name, kind in (sf.ALL_LAWS | sf.POPULATIONS).items()}
    if request.config.getoption("--update-golden"):
        TABLE.parent.mkdir(exist_ok=True)
        lines = (f"  {json.dumps(name)}: {json.dumps(counts)}" for name, counts in found.items())
        TABLE.write_text("{\n" + ",\n".join(lines) + "\n}\n", encoding="utf-8")
    stored = json.loads(TABLE.read_text(encoding="utf-8"))
    differing = {name: (stored.get(name), found.get(name)) for name in {*stored, *found}}
    differing = {name: pair for name, pair in differing.items() if pair[0] != pair[1]}
    assert not differing, "table, found; if intended: pytest --update-golden, and say why"
    # by hand: v, the constant, their product, the output; in the gradient the constant, its output
    assert found["viscous"] == {"value": 4, "gradient": 2}


def test_gradient_costs_a_small_multiple_of_the_value() -> None:
    """Derivatives by n inputs of m results, each at most a few times the value."""
    for name, law in CASES.items():
        found, directions = cost(law), 2 + len(law.states) + len(law.inputs)
        assert found.gradient <= 2 * directions * found.value, name


def instructions(law: sf.Law) -> int:
    """Arithmetic of force and rate, with common parts counted once."""
    v, N, z = ca.SX.sym("v"), ca.SX.sym("N"), state_symbols(law)
    outputs = ca.cse(ca.vertcat(law.force(v, N, z), law.rate(v, N, z)))
    free = ca.symvar(ca.vertcat(outputs, v, N, z))
    f = ca.Function("f", [ca.vertcat(*free)], [outputs])
    idle = {ca.OP_INPUT, ca.OP_OUTPUT, ca.OP_CONST}
    return sum(f.instruction_id(k) not in idle for k in range(f.n_instructions()))


def test_switched_off_option_costs_less_than_in_use_and_than_its_symbol() -> None:
    for law, name, off, on in table(__file__, "options")["options"]:
        kind = sf.ALL_LAWS[law]
        without = instructions(kind(**{name: off}))
        assert without < instructions(kind(**{name: on})), (kind, name)
        assert without < instructions(sf.symbolise(kind(), name)[0]), (kind, name)
    m1 = sf.BAM(K_s=0.0, K_e=0.0, K_m=0.0, K_es=0.0, K_ms=0.0)
    assert m1.inputs == ()
    assert cost(m1).value < cost(sf.BAM()).value < cost(sf.BAM(Q_e=0.01)).value
    assert cost(sf.Coulomb(v_eps=0.0)).value < cost(sf.Coulomb()).value
    assert cost(sf.QuarterCarGeneral(mu=0.0)).value < cost(sf.QuarterCarGeneral()).value - 8
