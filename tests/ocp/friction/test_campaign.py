"""Random machines that stop and reverse: solved by modes, as a referee sees them, or said.

The referee is `rubbing.Machine.follow`: the equations again in NumPy, modes by hand, SciPy.
"""

import pytest
from rubbing import KINDS, Machine, machine

from ocp import Solution, solve

SMALL = (12, 13, 48, 66, 68, 69, 72, 76, 80, 82)
"""Seeds of the suite, cheap ones of the kinds 0, 1, 4, 6, 8, 9 and 10."""
MANY = range(len(KINDS), len(KINDS) + 100)
NEAR = 1e-3
"""Tolerance of `solve`: how far the exact motion may end from its goal, over the way it goes."""
TELLING = ("Friction is still smooth", "Modes were not found", "re-simulated", "maximum number",
           "unstable", "No point satisfies", "time limit")  # fmt: skip
"""What a message has of a motion that is not right, or of another friction than was asked for."""


def judged(of: Machine, found: Solution) -> str:
    """What the motion turned out to be: "exact", "said", or what is wrong with it."""
    if found.modes and found.verified:
        missed = of.missed(found)
        return "exact" if missed < NEAR else f"misses by {missed:.1e}: {found.message}"
    return "said" if any(text in found.message for text in TELLING) else found.message


@pytest.mark.parametrize("seed", SMALL)
def test_machines_are_solved_by_modes(seed: int) -> None:
    of = machine(seed)
    assert judged(of, solve(of.problem(), starts=2, throw=False)) == "exact"


@pytest.mark.slow
def test_a_hundred_machines_are_solved_or_said() -> None:
    ends = dict[int, str]()
    for seed in MANY:
        of = machine(seed)
        ends[seed] = judged(of, solve(of.problem(), throw=False))
    wrong = {seed: text for seed, text in ends.items() if text not in ("exact", "said")}
    assert wrong == {}
    assert sum(text == "exact" for text in ends.values()) >= 98
