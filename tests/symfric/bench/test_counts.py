"""What a mechanism does not need is not there: counts of variants in both formulations."""

import pytest
from backends import needs_compiler

from symfric.bench.mechanisms import CountRow, compile_rows, counts

FOUR = (
    "frictionless",
    "constant normal",
    "reactions in one",
    "reactions in all",
)
BOTH = ("joint", "absolute")
ABSOLUTE = pytest.param("absolute", marks=pytest.mark.slow)
"""Takes seconds to build."""


class Rows(dict[tuple[str, str, str], CountRow]):
    """Counts by formulation, mechanism and variant, made for a formulation when first asked for."""

    def __missing__(self, key: tuple[str, str, str]) -> CountRow:
        self |= {(r.formulation, r.mechanism, r.variant): r for r in counts((key[0],))}
        return self[key]


@pytest.fixture(scope="module")
def rows() -> Rows:
    return Rows()


@pytest.mark.parametrize(
    ("formulation", "expected"),
    [("joint", [(8, 2), (8, 2), (8, 3), (8, 5)]),
     pytest.param(
         "absolute", [(56, 26), (56, 26), (56, 27), (56, 30)], marks=pytest.mark.slow)],
)  # fmt: skip
def test_unknowns_are_those_that_are_needed(
    rows: Rows, formulation: str, expected: list[tuple[int, int]]
) -> None:
    """Two multipliers of the rods, in absolute coordinates those of all joints; slider 4 carries
    its weight only, which is no unknown where its slide is in the tree."""
    found = (rows[formulation, "four_mass", v] for v in FOUR)
    assert [(r.states, r.algebraic) for r in found] == expected


@pytest.mark.parametrize("formulation", ["joint", ABSOLUTE])
def test_every_kind_of_friction_costs_what_it_is(rows: Rows, formulation: str) -> None:
    none, constant, one, every = (rows[formulation, "four_mass", variant] for variant in FOUR)
    for column in ("ode", "step", "nonzeros"):
        values = [getattr(r, column) for r in (none, constant, one, every)]
        assert values[0] < values[1] < values[3], column
        assert values[0] < values[2] < values[3], column
    assert every.step < 2 * none.step


def test_a_planar_mechanism_does_not_pay_for_space(
    rows: Rows,
) -> None:
    planar, spatial = (rows["joint", "double_pendulum", v] for v in ("planar", "spatial"))
    assert (planar.states, planar.algebraic) == (spatial.states, spatial.algebraic)
    assert planar.ode < spatial.ode
    assert planar.step < 0.9 * spatial.step


@pytest.mark.slow
def test_absolute_coordinates_pay_for_space_in_any_case(
    rows: Rows,
) -> None:
    planar, spatial = (rows["absolute", "double_pendulum", v] for v in ("planar", "spatial"))
    assert planar.nonzeros == spatial.nonzeros
    assert planar.ode > 0.99 * spatial.ode


@pytest.mark.slow
@pytest.mark.parametrize("variant", FOUR)
def test_joint_coordinates_cost_a_fraction_of_absolute_ones(rows: Rows, variant: str) -> None:
    few, many = (rows[formulation, "four_mass", variant] for formulation in BOTH)
    assert many.states == 7 * few.states
    assert many.ode > 10 * few.ode
    assert many.step > 15 * few.step


@pytest.mark.slow
@needs_compiler
def test_compilation_is_measured() -> None:
    rows = compile_rows(("joint",))
    assert [row.mechanism for row in rows] == ["slider_crank", "four_mass"]
    assert all(row.compile_s > 0 and row.build_s > 0 for row in rows)
    assert rows[0].lines < rows[1].lines < 20_000
