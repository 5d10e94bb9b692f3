"""Random steps: nothing dies, is silent or alters what is valid; and what does is found."""

import pytest
from law_cases import CASES, NO_STEP

from symfric import LuGre
from symfric.codegen import guards, law_block, plant_block, routines
from symfric.codegen.fuzz import Fuzzed, fuzz
from symfric.scenes import Drive

pytestmark = pytest.mark.heavy

LAWS = [name for name in CASES if name not in NO_STEP]
QUICK = {"brown_mcphee", "lugre", "maxwell_slip, event", "haessig_friedland", "dahl, n 0.5"}

LIMITED = {"quarter_car_general", "rate_and_state", "rate_and_state, slip"}
"""Without a value for every argument: a stroke beyond the damper's length, exp of any age."""

each_law = pytest.mark.parametrize(
    "name",
    [pytest.param(name, marks=[] if name in QUICK else pytest.mark.slow) for name in LAWS],
)


@each_law
@pytest.mark.parametrize("real", ["double", "float"])
def test_a_law_survives_random_steps(name, real, compiler):
    found = fuzz(law_block(CASES[name]), real, compiler, steps=20_000)
    assert found.ok, found
    assert found.last_resort == 0 or name in LIMITED, found
    assert found.valid > 15_000
    assert found.repaired > 1000


def test_a_plant_survives_random_steps(compiler):
    found = fuzz(plant_block(Drive(LuGre()).model()), "float", compiler, steps=5000)
    assert found.ok, found


def test_what_is_found_is_a_failure():
    assert Fuzzed("f", "float", 10, valid=8, repaired=2, last_resort=1).ok
    for found in ({"altered": 1}, {"unflagged": 1}, {"unfinished": 1}, {"report": "overflow"}):
        assert not Fuzzed("f", "float", 10, valid=8, repaired=2, **found).ok


def test_a_range_that_the_c_does_not_know_is_found(compiler, monkeypatch):
    monkeypatch.setattr("symfric.codegen.fuzz.state_limit", lambda v: 1e-3)
    assert fuzz(law_block(LuGre()), "double", compiler, steps=5000).unflagged > 0


def test_a_guard_that_is_silent_is_found(compiler, monkeypatch):
    def silent(*given):
        return guards.helpers(*given).replace("*status |= clamped;", "", 1)

    monkeypatch.setattr(routines, "helpers", silent)
    assert fuzz(law_block(LuGre()), "double", compiler, steps=5000).unflagged > 0


def test_a_guard_that_alters_what_is_valid_is_found(compiler, monkeypatch):
    def doubled(block, real, variable, *rest):
        name = variable.name
        return [*guards.mended(block, real, variable, *rest), f"{name} = {name} + {name};"]

    monkeypatch.setattr(routines, "mended", doubled)
    assert fuzz(law_block(LuGre()), "double", compiler, steps=5000).altered > 1000
