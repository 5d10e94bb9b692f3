"""Mutants of what judges laws: their choice, the machines they are judged on, their figures."""

from mutants.mutant import Mutant

CHOICE = "symfric/choice/"
FIGURES = "symfric/figures/"
SCENES = "symfric/scenes/"
INTEROP = "symfric/bench/interop.py"
T_SELECT = "tests/symfric/choice/test_select.py::test_"
T_JUDGED = ("tests/symfric/choice/test_judged_by_hand.py",)
T_STEPS = ("tests/symfric/choice/test_fixed_step.py",)
T_INTEROP = ("tests/symfric/bench/test_interop_bench.py",)
T_PRESETS = ("tests/symfric/scenes/test_presets.py",)


def of(scene: str) -> tuple[str, ...]:
    """The tests of a scene."""
    return (f"tests/symfric/scenes/test_{scene}.py",)


def figure(name: str) -> tuple[str, ...]:
    """The tests of a figure."""
    return (f"tests/symfric/figures/test_{name}.py",)


JUDGED = (
    Mutant(
        "the finest tolerance is timed", CHOICE + "continuation.py",
        "rtol, last = LOOSEST, nan", "rtol, last = 1.2 * finest, nan",
        (T_SELECT + "the_tolerance_is_the_loosest_that_keeps_the_accuracy",),
    ),
    Mutant(
        "any tolerance is loose enough", CHOICE + "continuation.py",
        "good = run is not None and last <= asked.accuracy", "good = run is not None",
        (T_SELECT + "the_tolerance_is_the_loosest_that_keeps_the_accuracy",),
    ),
    Mutant(
        "laws far off the data are ranked", CHOICE + "measured.py",
        "misfit > AS_GOOD * best", "misfit > 100 * best", T_JUDGED,
    ),
    Mutant(
        "what is ranked is ordered by its error", CHOICE + "ranking.py",
        "0.0 if row.ranked else error", "error", T_JUDGED,
    ),
    Mutant(
        "the clock decides the order", CHOICE + "ranking.py",
        "error, row.work or inf, row.law", "error, row.time_s, row.law", T_JUDGED,
    ),
    Mutant(
        "laws that are alike have ranks of their own", CHOICE + "ranking.py",
        "row.work <= ALIKE * head.work", "row.work <= head.work", T_JUDGED,
    ),
    Mutant(
        "widths go below their bounds", CHOICE + "smoothing.py",
        'if p.role == "width" else value', 'if p.role == "none" else value', T_JUDGED,
    ),
    Mutant(
        "no step is left out where errors stay the same", CHOICE + "smoothing.py",
        "LEAP = 4", "LEAP = 1", T_JUDGED,
    ),
    Mutant(
        "a law that moves otherwise is judged by its distance alone", CHOICE + "continuation.py",
        "reference.off(run.motion) if whole else own(run)", "reference.off(run.motion)",
        (T_SELECT + "a_law_that_moves_otherwise_is_counted_at_its_own_error",),
    ),
    Mutant(
        "what the clock says against the order is not told", CHOICE + "text.py",
        "FASTER * fastest.time_s < best.time_s", "FASTER * fastest.time_s < 0", T_JUDGED,
    ),
    Mutant(
        "an optimiser is given the steepest law", CHOICE + "text.py",
        "take = min(flat, key=lambda row: row.steepness)",
        "take = max(flat, key=lambda row: row.steepness)", T_JUDGED,
    ),
    Mutant(
        "a controller is given the law of the shortest steps", CHOICE + "text.py",
        "_in_c(row, counted) / (row.fixed_step or 1.0)",
        "_in_c(row, counted) * (row.fixed_step or 1.0)", T_JUDGED,
    ),
    Mutant(
        "words of papers for what is needed are not known", CHOICE + "nature.py",
        "ALIASES.get(plain, plain)", "plain", T_JUDGED,
    ),
    Mutant(
        "one run that keeps the error is enough", CHOICE + "smoothing.py",
        "for level in levels[-2:])", "for level in levels[-1:])", T_JUDGED,
    ),
    Mutant(
        "errors between two levels follow another power", CHOICE + "smoothing.py",
        "(wanted / good.error) ** (1 / order)", "(wanted / good.error) ** order", T_JUDGED,
    ),
    Mutant(
        "another motion is said of widths far from the speeds of a machine",
        CHOICE + "smoothing.py",
        "if levels[-1].s ** powers <= NARROW else None", "if True else None", T_JUDGED,
    ),
    Mutant(
        "another motion is said of neighbours at an extremum", CHOICE + "smoothing.py",
        " or min(a, b) < RATIO**LEAP:", ":", T_JUDGED,
    ),
    Mutant(
        "v_eps stays as bristles grow stiff", CHOICE + "smoothing.py",
        "if law.states or (value > NEGLIGIBLE", "if (value > NEGLIGIBLE", T_JUDGED,
    ),
    Mutant(
        "a law is ranked whose tighter run fails in rounding", CHOICE + "measured.py",
        "return problem.status is Status.MAX_STEPS", "return True",
        ("tests/symfric/choice/test_budget.py",),
    ),
    Mutant(
        "bristles are damped another way as they grow stiff", CHOICE + "smoothing.py",
        '"damping": -0.5', '"damping": -1.0', T_JUDGED,
    ),
    Mutant(
        "the first larger step is the largest", CHOICE + "measured.py",
        "for factor in (5.0, 2.0):", "for factor in (2.0, 5.0):", T_STEPS,
    ),
    Mutant(
        "inputs of a step are those at its start", CHOICE + "measured.py",
        "np.multiply(k + 0.5, h", "np.multiply(k, h", T_STEPS,
    ),
    Mutant(
        "the load does not slow the clutch that holds", SCENES + "rotating.py",
        "pull = (self.T_1 / self.J_1 + self.T_2", "pull = (self.T_1 / self.J_1 - self.T_2",
        of("clutch"),
    ),
    Mutant(
        "the nip roller lags the other way", SCENES + "rotating.py",
        "(v_rel.symbol - self.lag * line.symbol)", "(v_rel.symbol + self.lag * line.symbol)",
        of("nip"),
    ),
    Mutant(
        "pieces of the string are as soft as the whole", SCENES + "rotating.py",
        "torques = n * (self.k", "torques = (self.k", of("drill_string"),
    ),
    Mutant(
        "mud does not brake the bit", SCENES + "rotating.py",
        "torques[n - 1] - self.c_b * bit.symbol", "torques[n - 1] - 0 * self.c_b * bit.symbol",
        of("drill_string"),
    ),
    Mutant(
        "the second block rubs as the first", SCENES + "blocks.py",
        '(self.law_of("block_2"), self.m_2)', "(self.law, self.m_2)", of("coupled_blocks"),
    ),
    Mutant(
        "samples of a law are rubbed from somewhere else", SCENES + "rigs.py",
        "            ode=v.symbol,", "            ode=2 * v.symbol,", of("prescribed"),
    ),
    Mutant(
        "a level of the main study has two digits swapped", SCENES + "rigs.py",
        "4.2672, 2.6063,", "4.2672, 2.6036,", of("prescribed"),
    ),
    Mutant(
        "mud of the paper is ten times thinner", SCENES + "rotating.py",
        '"c": 172.3067, "c_b": 50.0}', '"c": 172.3067, "c_b": 5.0}', of("drill_string"),
    ),
    Mutant(
        "a road of 30 mm rises by 60", SCENES + "rigs.py",
        '"amplitude": millimetres / 1000,', '"amplitude": millimetres / 500,', T_PRESETS,
    ),
    Mutant(
        "elements keep their sizes where their level changes", SCENES + "presets.py",
        "x * self.common[level] / whole", "x", T_PRESETS,
    ),
    Mutant(
        "a place without a law of its own does not rub", SCENES + "base.py",
        "return self.law if own is None else own", "return own", of("places"),
    ),
    Mutant(
        "the law of a place keeps its own numbers in a preset", SCENES + "base.py",
        "laws |= {n: value for n, value in others.items() if isinstance(value, Law)}", "pass",
        T_PRESETS,
    ),
    Mutant(
        "a pushed block is shown with the force for its friction", FIGURES + "pushing.py",
        '"F": "friction"}', '"F": "force"}', figure("push"),
    ),
    Mutant(
        "every rest lasts as long as the first", FIGURES + "sliding.py",
        "t < slide_for + hold)", "t < slide_for + 0.01)", figure("dwell"),
    ),
    Mutant(
        "the faster leg is as long in time as the slow one", FIGURES + "sliding.py",
        "[0.5 * slow, slow / factor, slow]", "[0.5 * slow, slow, slow]", figure("velocity_step"),
    ),
    Mutant(
        "the velocity does not jump back", FIGURES + "sliding.py",
        "ca.logic_and(t >= ends[0], t < ends[1])", "t >= ends[0]", figure("velocity_step"),
    ),
    Mutant(
        "the block that is pulled to and fro stops half way", FIGURES + "pushing.py",
        "force, 1.5 * period)", "force, 0.5 * period)", figure("stiction"),
    ),
    Mutant(
        "who passes the goal fast has not missed it", INTEROP,
        'run.final["v"] * T)', '0 * run.final["v"])', T_INTEROP,
    ),
    Mutant(
        "the referee holds controls one interval late", INTEROP,
        "held = Hold(np.linspace(0.0, T, N + 1)[:-1]", "held = Hold(np.linspace(0.0, T, N + 1)[1:]",
        T_INTEROP,
    ),
    Mutant(
        "moves start where the model starts", INTEROP,
        "rest = {v.name: 0.0 for v in model.x}", "rest = {}", T_INTEROP,
    ),
    Mutant(
        "collocation is called flow", INTEROP,
        '("opti", "flow"): opti_flow,', '("opti", "flow"): opti_collocation,', T_INTEROP,
    ),
)  # fmt: skip
