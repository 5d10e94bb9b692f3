"""What a mechanism does not need is not there: counts of variants in both formulations."""

import pytest

from symfric.bench.counts import VARIANTS, CountRow, compile_rows, counts
from symfric.integrator.compiler import find_compiler


@pytest.fixture(scope="module")
def rows() -> dict[tuple[str, str], CountRow]:
    return {(r.mechanism, r.variant): r for r in counts(("joint",))}


FOUR = (
    "frictionless",
    "constant normal",
    "reactions in one",
    "reactions in all",
)


def test_unknowns_are_those_that_are_needed(rows: dict[tuple[str, str], CountRow]) -> None:
    """Two multipliers of the rods; slider 4 carries its weight only, which is no unknown."""
    found = [(rows["four_mass", v].states, rows["four_mass", v].algebraic) for v in FOUR]
    assert found == [(8, 2), (8, 2), (8, 3), (8, 5)]


def test_every_kind_of_friction_costs_what_it_is(rows: dict[tuple[str, str], CountRow]) -> None:
    none, constant, one, every = (rows["four_mass", variant] for variant in FOUR)
    for column in ("ode", "step", "nonzeros"):
        values = [getattr(r, column) for r in (none, constant, one, every)]
        assert values[0] < values[1] < values[3], column
        assert values[0] < values[2] < values[3], column
    assert every.step < 2 * none.step


def test_a_planar_mechanism_does_not_pay_for_space(rows: dict[tuple[str, str], CountRow]) -> None:
    planar, spatial = (rows["double_pendulum", v] for v in ("planar", "spatial"))
    assert (planar.states, planar.algebraic) == (spatial.states, spatial.algebraic)
    assert planar.ode < spatial.ode
    assert planar.step < 0.9 * spatial.step


def test_joint_coordinates_cost_a_fraction_of_absolute_ones(
    rows: dict[tuple[str, str], CountRow],
) -> None:
    ((name, variant, mechanism),) = [v for v in VARIANTS if v[:2] == ("four_mass", FOUR[0])]
    model = mechanism.build(formulation="absolute")
    few = rows[name, variant]
    assert (len(model.x), len(model.z)) == (7 * few.states, 26)
    assert model.function("ode").n_instructions() > 15 * few.ode


@pytest.mark.skipif(find_compiler() is None, reason="needs a C compiler")
def test_compilation_is_measured() -> None:
    rows = compile_rows(("joint",))
    assert [row.mechanism for row in rows] == ["slider_crank", "four_mass"]
    assert all(row.compile_s > 0 and row.build_s > 0 for row in rows)
    assert rows[0].lines < rows[1].lines < 20_000
