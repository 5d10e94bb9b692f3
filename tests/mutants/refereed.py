"""Mutants of the referee of `symfric stress` and of how it is asked."""

from mutants.mutant import Mutant

LAWS = "symfric/stress/referee/laws.py"
SCENES = "symfric/stress/referee/scenes.py"
SOLVE = "symfric/stress/referee/solve.py"
JUDGE = "symfric/stress/judge.py"
T_REFEREE = ("tests/symfric/stress/test_referee.py",)
T_JUDGE = ("tests/symfric/stress/test_judge.py",)

REFEREED = (
    Mutant(
        "the referee's bristle never slides", LAWS,
        "rate = v - alpha * sigma_0 * v * sign(v, v_eps) * z[0] / g", "rate = v", T_REFEREE,
    ),
    Mutant(
        "the referee's blocks pull each other the wrong way", SCENES,
        'between = p["k_c"] * (x_2 - x_1)', 'between = p["k_c"] * (x_1 - x_2)', T_REFEREE,
    ),
    Mutant(
        "a resting block of the referee carries any load", SOLVE,
        "return abs(F_e) - mu_s * N", "return -1.0", T_REFEREE,
    ),
    Mutant(
        "the referee is not asked", JUDGE,
        "if answer is None or answer.doubt[1:].min() > DOUBT:", "if True:", T_JUDGE,
    ),
    Mutant(
        "a run without steps left is undecided", JUDGE,
        'kind, group = "refused", "too many steps, right so far"',
        'kind, group = "undecided", "too many steps"', T_JUDGE,
    ),
    Mutant(
        "ramps in the equations of a model are leapt over",
        "symfric/integrator/equations/inputs.py",
        "return inputs.stopping_at(times) if times else inputs", "return inputs",
        ("tests/symfric/integrator/equations/test_onsets.py",),
    ),
)  # fmt: skip
