"""Mutants of plants, of what follows a jump, and of numbers of inputs as data."""

from mutants.mutant import Mutant

FOLLOWING = "symfric/integrator/equations/following.py"
CONSTANTS = "symfric/integrator/equations/expressions.py"
PLANT, LOOPS = "symfric/integrator/plant.py", "symfric/integrator/running/plants.c"
EVENTFUL = "symfric/integrator/running/plants.py"
LANES = "symfric/integrator/many/plants.c"
T_FOLLOWING = ("tests/symfric/integrator/equations/test_following.py",)
T_CONSTANTS = ("tests/symfric/integrator/equations/test_constants.py",)
T_STEPPER = ("tests/symfric/integrator/test_stepper.py",)
T_EVENTFUL = ("tests/symfric/integrator/running/test_eventful_plants.py",)
T_LANES = ("tests/symfric/integrator/many/test_plants.py",)

PLANTS = (
    Mutant(
        "plant: unknowns may leap far away behind a jump", FOLLOWING,
        "NEARER, ANY = 0.5, 1e10", "NEARER, ANY = 1e10, 1e10", T_FOLLOWING,
    ),
    Mutant(
        "plant: unknowns follow into a jam", FOLLOWING,
        "return now if guard >= 0 else None", "return now", T_FOLLOWING,
    ),
    Mutant(
        "plant: the second correction is left out", FOLLOWING,
        "after = middle + change", "after = middle", T_FOLLOWING,
    ),
    Mutant(
        "plant: the loop in C is content sooner", FOLLOWING,
        "if (look[1] <= $done) {", "if (look[1] <= 1e6 * $done) {", T_FOLLOWING,
    ),
    Mutant(
        "plant: exponents are data, too", CONSTANTS,
        "_applied(op, read(places[0]), ca.SX(work[places[1]]))",
        "_applied(op, read(places[0]), read(places[1]))", T_CONSTANTS,
    ),
    Mutant(
        "plant: the sample moves on where the plant did not", LOOPS,
        "m->count[b] += m->S[b * (MEM + N) + T] >= R[T_END];", "m->count[b] += 1;", T_STEPPER,
    ),
    Mutant(
        "plant: unknowns do not follow inputs", LOOPS,
        "return m->ready[b] || !symfric_follow(m->S + b * (MEM + N) + MEM, R + DATA);",
        "return 1;", T_STEPPER,
    ),
    Mutant(
        "plant: a copy shares the numbers", PLANT,
        "plants = self._plants.copy()", "plants = self._plants", T_STEPPER,
    ),
    Mutant(
        "plant: signals are those of the step before", PLANT,
        "        self._seen = False\n        if short", "        if short", T_STEPPER,
    ),
    Mutant(
        "plant: a jump of inputs is no event", EVENTFUL,
        "self.events.entered()", "self.events.tolerance += 0.0", T_EVENTFUL,
    ),
    Mutant(
        "plant: a terminal event ends nothing", EVENTFUL,
        "if plants.why[b] == OVER or not", "if not", T_EVENTFUL,
    ),
    Mutant(
        "plant: plants in lanes that failed go on", LANES,
        "if (begin) m->why[b] = symfric_takes_over(m, b) ? AGAIN : SEARCHED;",
        "if (begin) { symfric_takes_over(m, b); m->why[b] = AGAIN; }", T_LANES,
    ),
    Mutant(
        "plant: an interrupted step has half happened", PLANT,
        "self._plants.back_to(before)", "pass", T_STEPPER + T_EVENTFUL,
    ),
    Mutant(
        "plant: a failed one stands for ever", PLANT,
        "plants.S[b] = State.at(t, plants.first_step(), y.copy())", "pass", T_STEPPER,
    ),
)  # fmt: skip
