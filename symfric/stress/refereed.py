"""A case as a question to the referee, which takes numbers only."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import final

import numpy as np

from symfric.foundation.parameters import parameters, with_values
from symfric.laws import law_from_text
from symfric.scenes import ALL_SCENES
from symfric.stress.problem import Array, Problem
from symfric.stress.referee.solve import NO_FORCE, SINE, Question, Signal, knows, solve

States = Callable[[Array], Array]
"""From times to states, shape (nx, times)."""
RTOL, ENOUGH = 1e-10, 0.3
"""Tolerance of the referee, and the own error [tolerances] that needs no smaller one."""
GAVE_UP = (ArithmeticError, ValueError)


def question(ready: Problem, times: Array) -> Question | None:
    """The case at `times`, the first of which is its start; None where the referee has no answer.

    Start values are those of the model: a bristle starts at its steady state there.
    """
    case, model = ready.case, ready.model
    if not knows(case.law, case.scene) or any(name.endswith("mode") for name in case.x0):
        return None
    scene = with_values(ALL_SCENES[case.scene](law_from_text(case.law)), case.values)
    numbers = {name: float(known.value) for name, known in parameters(scene).items()}
    given = case.inputs.get("force")
    signal = SINE if case.scene == "drive" else NO_FORCE
    return Question(
        law=case.law,
        scene=case.scene,
        p=numbers,
        forms=case.forms,
        signal=signal if given is None else Signal(given.kind, given.values, given.t),
        y=model.initial_state(case.x0, ready.p, case.t_start),
        scale=model.nominal("x"),
        times=times,
    )


@final
@dataclass(frozen=True, eq=False)
class Answer:
    """The referee's motion of a case.

    Attributes:
        asked: the case.
        rtol: at which SciPy solved it.
        doubt: difference [tolerances] from another solve, at the times asked for.
    """

    asked: Question
    rtol: float
    doubt: Array

    def states(self, times: Array) -> Array:
        """States at times within the span, shape (nx, times)."""
        at, back = np.unique([self.asked.times[0], *times], return_inverse=True)
        return solve(replace(self.asked, times=at), self.rtol)[:, back[1:]]

    def onward(self, times: Array, start: Array) -> Array | None:
        """States at `times` of the motion that begins at the first of them with `start`."""
        try:
            return solve(replace(self.asked, times=times, y=start), self.rtol)
        except GAVE_UP:
            return None


def answered(ready: Problem, distance: Callable[[Array, States], Array]) -> Answer | None:
    """The referee's answer, or None where it has none.

    `distance` is that of a table of states at the problem's times from others, over time. The
    solve at 1e-10 is compared with one at 1e-9, and where that says too little with one at 1e-12.
    """
    asked = question(ready, ready.times)
    if asked is None:
        return None
    try:
        fine = solve(asked, RTOL)
        coarse = Answer(asked, 10 * RTOL, np.zeros(0))
        answer = Answer(asked, RTOL, distance(fine, coarse.states))
        if answer.doubt.max() > ENOUGH:
            finest = Answer(asked, RTOL / 100, np.zeros(0))
            answer = replace(finest, doubt=distance(fine, finest.states))
    except GAVE_UP:
        return None
    return answer
