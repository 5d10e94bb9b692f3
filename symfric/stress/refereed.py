"""A case as a question to the referee, which takes numbers only."""

from symfric.foundation.parameters import parameters, with_values
from symfric.laws import law_from_text
from symfric.scenes import ALL_SCENES
from symfric.stress.problem import Array, Problem
from symfric.stress.referee.solve import NO_FORCE, SINE, Question, Signal, knows


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
