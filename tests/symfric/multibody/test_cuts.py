"""Long chains: the same equations and steps, at a cost that grows with the links alone."""

import casadi as ca
import numpy as np
import pytest

from symfric import BrownMcPhee, LuGre, Model
from symfric.bench.multibody import chain
from symfric.integrator.equations.blocks import blocks, corrected, signs
from symfric.integrator.equations.inputs import input_data
from symfric.integrator.equations.system import System, system
from symfric.integrator.methods.tableaux import METHODS
from symfric.laws import Law
from symfric.multibody import prepare
from symfric.multibody.kinematics import Cuts

pytestmark = pytest.mark.heavy

GAMMA = float(METHODS["rodas5p"].diagonal or 0.0)
LAWS = {"none": None, "brown_mcphee": BrownMcPhee(v_t=0.01), "lugre": LuGre(sigma_0=1e3)}
each_law = pytest.mark.parametrize("law", LAWS.values(), ids=LAWS)


def unknowns(model: Model) -> System:
    return system(model, input_data(model, None, 0.0, 1.0))


def both(links: int, law: Law | None, monkeypatch: pytest.MonkeyPatch) -> tuple[System, System]:
    """The same chain with cuts and without."""
    found: list[System] = []
    for first in (2, 1000):
        monkeypatch.setattr(prepare, "LONG", first)
        monkeypatch.setattr(prepare, "LONG_WITH_FRICTION", first)
        found.append(unknowns(chain(links, law)))
    return found[0], found[1]


def some(n: int, seed: int = 0) -> np.ndarray:
    """Unknowns of about 0.3, normal forces among them positive."""
    return np.abs(np.random.default_rng(seed).normal(0.3, 0.1, n))


def test_cut_keeps_numbers_and_symbols_and_knows_what_is_used() -> None:
    cuts, x = Cuts(), ca.SX.sym("x", 2)
    kept = cuts(3, ca.vertcat(1.5, x[0], ca.sin(x[1]), ca.SX(1, 1)))
    assert (cuts.links, str(cuts.values)) == ([3], "sin(x_1)")
    assert (kept.nnz(), ca.depends_on(kept, x[1])) == (3, False)
    unused, last = cuts(0, ca.cos(x[0])), cuts(1, kept[2] * x[0])
    assert cuts.needed(last + 1) == [0, 2]
    assert cuts.needed(unused * 2) == [1]


@each_law
def test_steps_of_cut_chains_are_those_of_whole_ones(
    law: Law | None, monkeypatch: pytest.MonkeyPatch
) -> None:
    """W k = right for both, although one never sees W."""
    cut, whole = both(4, law, monkeypatch)
    assert cut.inner is not None
    assert whole.inner is None
    y, right, memory = some(cut.n), some(cut.n, 1), some(cut.n, 2)
    found = []
    for made in (cut, whole):
        block = blocks(made, GAMMA)
        found.append(block.solve(block.factor(y, 0.01, []), right, memory).full().ravel())
    scale = np.abs(found[1]).max()
    assert found[0] == pytest.approx(found[1], abs=1e-10 * scale)


@each_law
def test_signs_and_refined_unknowns_are_the_same(
    law: Law | None, monkeypatch: pytest.MonkeyPatch
) -> None:
    made = both(3, law, monkeypatch)
    y = some(made[0].n)
    one, other = ([float(sign) for sign in signs(s, GAMMA)(y, 0.01, [])[:2]] for s in made)
    assert one == other
    refined = [corrected(s)(y, []).full().ravel() for s in made]
    assert refined[0] == pytest.approx(refined[1], rel=1e-9, abs=1e-9)


def instructions(links: int, law: Law | None) -> int:
    made = unknowns(chain(links, law))
    block = blocks(made, GAMMA)
    stage = block.f.n_instructions() + block.solve.n_instructions()
    return block.slopes.n_instructions() + block.pack.n_instructions() + 8 * stage


@pytest.mark.slow
@each_law
def test_cuts_are_made_where_they_pay(law: Law | None, monkeypatch: pytest.MonkeyPatch) -> None:
    """At the length from which they are made; beyond it the cost grows with the links alone."""
    name = "LONG" if law is None else "LONG_WITH_FRICTION"
    longest, found = getattr(prepare, name), list[int]()
    for first, links in ((2, longest), (2, 2 * longest), (1000, longest)):
        monkeypatch.setattr(prepare, name, first)
        found.append(instructions(links, law))
    assert found[0] < 1.05 * found[2]
    assert np.log2(found[1] / found[0]) < 1.15
