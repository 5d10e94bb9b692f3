"""Mutants of the emitter: logic, branches, order, places."""

from mutants.mutant import Mutant

LOGIC = "symfric/emitter/logic.py"
BRANCHES = "symfric/emitter/branches.py"
STATEMENTS = "symfric/emitter/statements.py"
SCHEDULE = "symfric/emitter/statements.py"
EMIT = "symfric/emitter/emit.py"
T_BITS = ("tests/symfric/emitter/test_emit.py",)
T_LOGIC = ("tests/symfric/emitter/test_logic.py",)
T_BRANCHES = ("tests/symfric/emitter/test_branches.py",)
T_SCHEDULE = ("tests/symfric/emitter/test_schedule.py",)
T_RANDOM = ("tests/symfric/emitter/test_random_graphs.py",)

EMITTED = (
    Mutant(
        "the larger of two is the smaller one", LOGIC,
        "order = (a, b) if op == ca.OP_FMIN else (b, a)", "order = (a, b)", T_BITS,
    ),
    Mutant(
        "a clip lets through what is not a number", LOGIC,
        "if not self.number[b]:\n", "if True:\n", T_BITS,
    ),
    Mutant(
        "bounds in the wrong order are taken for a clip", LOGIC,
        "or not ordered:", "or False:", T_LOGIC,
    ),
    Mutant(
        "not less is taken for more or equal", LOGIC,
        "OPPOSITE = {ca.OP_EQ: ca.OP_NE,", "OPPOSITE = {ca.OP_LT: ca.OP_LE, ca.OP_EQ: ca.OP_NE,",
        T_LOGIC,
    ),
    Mutant(
        "negations go in without their and, or", LOGIC,
        "other = ca.OP_OR if node.op == ca.OP_AND else ca.OP_AND", "other = node.op", T_BITS,
    ),
    Mutant(
        "a bool is compared with 0 as a number", LOGIC,
        "return i if self.logical[i] else self.compared(", "return self.compared(", T_LOGIC,
    ),
    Mutant(
        "the sign of a number counts as its magnitude against 0", LOGIC,
        "(node.op in TRUTHFUL and op in OPPOSITE)", "(node.op in TRUTHFUL)", T_BITS,
    ),
    Mutant(
        "what both sides need stands in the first", BRANCHES,
        "while region != other:", "while False:", T_RANDOM,
    ),
    Mutant(
        "cheap sides are branches", BRANCHES, "LEAST = 4", "LEAST = 1", T_BRANCHES,
    ),
    Mutant(
        "no side is worth a branch", BRANCHES, "LEAST = 4", "LEAST = 4000", T_BRANCHES,
    ),
    Mutant(
        "branches are nested without end", BRANCHES, "DEEPEST = 30", "DEEPEST = 130", T_BRANCHES,
    ),
    Mutant(
        "branches that wait for each other stay so", STATEMENTS,
        "if not waiting:", "if True:", T_BRANCHES,
    ),
    Mutant(
        "a variable is shared with a side that others read", STATEMENTS,
        "if uses[i] == 1}", "if uses[i] >= 1}", T_BRANCHES,
    ),
    Mutant(
        "a result is never written inside a branch", STATEMENTS,
        "if i in once and not stores.late:", "if False:", T_BRANCHES,
    ),
    Mutant(
        "the order of statements does not look at what they end", SCHEDULE,
        "return made - ended if made or ended else IDLE,", "return 0,", T_SCHEDULE,
    ),
    Mutant(
        "a state is written before it is read", EMIT,
        "return sorted({*wanted, *(i for i, text in self.loads.items() if text in written)})",
        "return sorted(wanted)", T_BRANCHES,
    ),
    Mutant(
        "results are written early over arguments without a name", EMIT,
        "late or not all(", "late or False and all(", T_BRANCHES,
    ),
)  # fmt: skip
