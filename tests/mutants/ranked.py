"""Mutants of what is ranked and told: budgets and rows of a choice, pages, plates, doubts."""

from mutants.mutant import Mutant

BUDGET = "symfric/choice/continuation.py"
T_BUDGET = ("tests/symfric/choice/test_budget.py",)
CONTINUATION = "symfric/choice/continuation.py"
ROW = "symfric/choice/ranking.py"
T_JUDGED_BY_HAND = ("tests/symfric/choice/test_judged_by_hand.py",)
SOFTNESS = "symfric/choice/smoothing.py"
VERDICT = "symfric/choice/text.py"
FRICTION = "symfric/choice/friction.py"
NATURE = "symfric/choice/nature.py"
TEXT = "symfric/choice/text.py"
T_TABLE = ("tests/symfric/choice/test_select.py::test_laws_left_out_stand_by_the_reason",)
STEADY = "tests/steady.py"
T_STEADY = ("tests/docs/test_steady.py",)
PLATE = "symfric/gallery/plate.py"
T_RENDERING = ("tests/symfric/gallery/test_rendering.py",)
APP = "symfric/cli/app.py"
T_OUTPUT = ("tests/symfric/cli/test_output.py",)
DOUBTS = "ocp/formulation/validate.py"
T_DOUBTS = ("tests/ocp/formulation/test_doubts.py",)

RANKED = (
    Mutant(
        "the search for events costs nothing", BUDGET,
        "+ (EVENTS if model.events else 0)",
        "", T_BUDGET,
    ),
    Mutant(
        "a run is made twice", BUDGET,
        "        if (s, rtol) in self._runs:\n            return self._runs[s, rtol]\n",
        "", T_BUDGET,
    ),
    Mutant(
        "runs that fail cost nothing", BUDGET,
        "                self.attempts.append(run.statistics.steps + run.statistics.rejections)\n",
        "                pass\n", T_BUDGET,
    ),
    Mutant(
        "a large machine may take no attempt", BUDGET,
        "max(LEAST, self.work // self.instructions)",
        "self.work // self.instructions", T_BUDGET,
    ),
    Mutant(
        "a jam is tried again at a looser tolerance", CONTINUATION,
        "            if problem.status is not Status.MAX_STEPS:\n                raise\n",
        "", T_BUDGET,
    ),
    Mutant(
        "one tolerance that keeps the accuracy by chance is enough", CONTINUATION,
        "        if good and before is not None:\n            return *before, last",
        "        if good:\n            return rtol, run, last", T_BUDGET,
    ),
    Mutant(
        "the finest run has no error of its own", CONTINUATION,
        "said = own(found) if rtol > finest else gap",
        "said = own(found)", T_BUDGET,
    ),
    Mutant(
        "a fine run that takes too much is begun", CONTINUATION,
        "able = near.rtol <= asked.fine or FINER * near.attempts <= runs.most",
        "able = True", T_BUDGET,
    ),
    Mutant(
        "a law is judged at its driest, not its nearest", CONTINUATION,
        "return next(level for level in levels.levels if not level.error > AS_NEAR * least)",
        "return levels.levels[-1]", T_BUDGET,
    ),
    Mutant(
        "all of the budget goes into drier runs", CONTINUATION,
        "        if not runs.left(ON_THE_WAY):\n",
        "        if False:\n", T_BUDGET,
    ),
    Mutant(
        "laws are alike in chains", ROW,
        "        found.append(replace(row, rank=rank))\n    return found",
        "        head = row\n        found.append(replace(row, rank=rank))\n    return found",
        T_JUDGED_BY_HAND,
    ),
    Mutant(
        "a slow error is followed for ever", SOFTNESS,
        "elif len(levels) > MOST:",
        "elif False:", T_JUDGED_BY_HAND,
    ),
    Mutant(
        "a scale of a law stops at its bound in silence", SOFTNESS,
        ' if p.role == "width" else value',
        "", T_JUDGED_BY_HAND,
    ),
    Mutant(
        "the clock contradicts what is alike", VERDICT,
        "fastest.rank != best.rank and ",
        "", T_JUDGED_BY_HAND,
    ),
    Mutant(
        "the peak of a law is that of a coarse grid", FRICTION,
        "return float(max(F[k], steady_force(law, near, N).max())) / N",
        "return float(F[k]) / N", T_JUDGED_BY_HAND,
    ),
    Mutant(
        "inverse speeds are no speeds", FRICTION,
        "speeds += [1 / float(p.value)",
        "speeds += [float(p.value)", T_JUDGED_BY_HAND,
    ),
    Mutant(
        "nobody says that a law has times of its own", NATURE,
        "        if times:\n",
        "        if False:\n", T_JUDGED_BY_HAND,
    ),
    Mutant(
        "all laws of the table are alike", TEXT,
        "> 1\n",
        "> 0\n", T_TABLE,
    ),
    Mutant(
        "one is a power of ten", TEXT,
        '.replace("e+00", "")',
        "", T_JUDGED_BY_HAND,
    ),
    Mutant(
        "of a number the last nudge is told", STEADY,
        "key=lambda one: one.moved / one.room if one.moved else 0.0",
        "key=lambda one: 0.0", T_STEADY,
    ),
    Mutant(
        "numbers are heard again in the next block", STEADY,
        "            heard.clear()\n",
        "", T_STEADY,
    ),
    Mutant(
        "a negative number is no count", STEADY,
        'if by_rounding or not a.lstrip("+-").isdigit()',
        "if by_rounding or not a.isdigit()", T_STEADY,
    ),
    Mutant(
        "a plate is drawn whatever its text says", PLATE,
        "if not holds]",
        "if holds is None]", T_RENDERING,
    ),
    Mutant(
        "nobody reads what was checked", PLATE,
        "checked=tuple(claims)",
        "checked=()", T_RENDERING,
    ),
    Mutant(
        "a full disk is told by its number", APP,
        "error.errno == ENOSPC",
        "False", T_OUTPUT,
    ),
    Mutant(
        "an input held at zero is doubted", DOUBTS,
        "0 < most <= inputs",
        "most <= inputs", T_DOUBTS,
    ),
    Mutant(
        "algebraic variables have no usual size", DOUBTS,
        "(*one.model.x, *one.model.z)",
        "one.model.x", T_DOUBTS,
    ),
)  # fmt: skip
