"""Arguments of `solve` are refused whatever way it goes: smooth, by layers, modes, shooting."""

from typing import Any

import numpy as np
import pytest
from bad_values import NAN, Thing, flag, number

from ocp import Phase, Problem, Radau, Shooting, integral, solve
from ocp.friction.homotopy import sharpened
from symfric import BrownMcPhee, ExactCoulomb, LuGre, drive

HUGE = 10**400
MESHES = [0, -1, NAN, "a", 1.5, [], [0, 1, 0.5], True, HUGE, [HUGE, 1], {}, Thing(), [[0, 1]] * 2]
GUESSES = [5, "a", [1], {"x": HUGE}, {"x": "a"}, {"y": 1.0}, {5: 1}, {"x": [NAN]}, {"x": {}}]
WRONG: dict[str, list[Any]] = {
    "intervals": [*MESHES, [0, "a", 1], "10"],
    "guess": [*GUESSES, {"x": lambda _: "a"}, {"x": lambda t: t[:3]}],
    "tolerance": number(0.0, HUGE),
    "max_time": number(0.0, HUGE, optional=True),
    "resting_margin": number(0.0, 0.2, HUGE),
    "starts": [0, HUGE, 1.5, "a", None],
    "friction": ["x", 5, None, np.zeros(3), []],
    "refine": flag(),
    "verify": flag(),
    "throw": flag(),
    "progress": [5, "a"],
    "scheme": ["radau", Radau, 5],
    "solver": ["ipopt", 5],
}
NARROW = drive(BrownMcPhee(mu_s=3.0, mu_d=3.0, v_t=1e-5), m=2.0, N=1.0)
WIDE = drive(BrownMcPhee(mu_s=3.0, mu_d=3.0, v_t=0.1), m=2.0, N=1.0)
WAYS = {
    "by modes": (NARROW, {}),
    "by layers": (NARROW, {"friction": "sharpen"}),
    "smooth": (WIDE, {"friction": "smooth"}),
    "by events": (drive(ExactCoulomb(), m=2.0, N=1.0), {}),
    "shooting": (drive(LuGre(), m=2.0, N=1.0), {"scheme": Shooting("exponential", 4)}),
}


def move(model: Any) -> Problem:
    ends = {"start": {"x": 0.0, "v": 0.0}, "end": {"x": 0.1, "v": 0.0}}
    return Problem(Phase(model, 1.0, **ends), integral(lambda s: s.force**2))


@pytest.mark.parametrize("way", WAYS)
def test_wrong_arguments_are_refused_on_every_way(way: str) -> None:
    model, more = WAYS[way]
    problem, taken = move(model), list[str]()
    for name, values in WRONG.items():
        for value in values:
            try:
                solve(problem, **{"max_time": 1e-3, "throw": False, **more, name: value})
            except ValueError as error:
                assert name in str(error), (name, value, str(error))
            else:
                taken.append(f"{name}={value!r}")
    assert taken == []


def test_fractions_say_how_many_intervals_layers_begin_with(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    asked = list[int]()

    def seen(*given: Any, intervals: int, **more: Any) -> Any:
        asked.append(intervals)
        return sharpened(*given, intervals=intervals, **more)

    monkeypatch.setattr("ocp.strategies.sharpened", seen)
    for intervals in (None, 25, np.int64(25), np.linspace(0, 1, 31), [[0.0, 0.5, 1.0]]):
        solve(move(NARROW), intervals=intervals, max_time=1e-3, throw=False)
    assert asked == [60, 25, 25, 30, 2]
