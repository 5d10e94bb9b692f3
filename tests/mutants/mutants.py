"""One-line defects that the tests must see: name, file, old text, new text, tests that must fail.

Where the line of a mutant is rewritten, rewrite the mutant: `tests/test_mutants.py` says so.
"""

from mutants.beside import BESIDE
from mutants.chosen import CHOSEN
from mutants.compensated import COMPENSATED
from mutants.derivatives import DERIVATIVES
from mutants.devices import DEVICES
from mutants.dry import DRY
from mutants.emitted import EMITTED
from mutants.ensembles import ENSEMBLES
from mutants.exported import EXPORTED
from mutants.fits import FITS
from mutants.generated import GENERATED
from mutants.held import HELD
from mutants.judged import JUDGED
from mutants.loops import LOOPS
from mutants.machines import MACHINES
from mutants.mutant import Mutant
from mutants.pictured import PICTURED
from mutants.plants import PLANTS
from mutants.ranked import RANKED
from mutants.refereed import REFEREED
from mutants.robots import ROBOTS
from mutants.shown import SHOWN
from mutants.solvers import RESULTS, SOLVERS
from mutants.told import TOLD
from mutants.written import WRITTEN

STEP = "symfric/integrator/step/attempt.py"
WATCH = "symfric/integrator/step/attempt.py"
EVENTS = "symfric/integrator/running/events.py"
SEARCH = "symfric/integrator/running/search.c"
CROSSINGS = "symfric/integrator/running/crossings.py"
RUN = "symfric/integrator/running/run.py"
INITIAL = "symfric/integrator/equations/initial.py"
EMITTER = "symfric/emitter/emit.py"
STATEMENTS = "symfric/emitter/statements.py"
COLLOCATION = "ocp/transcription/collocation.py"

LOOP = "symfric/integrator/running/march.c"
T_OUTPUTS = ("tests/symfric/integrator/running/test_outputs.py",)
T_STEP = ("tests/symfric/integrator/step/test_attempt.py",)
T_WATCH = ("tests/symfric/integrator/step/test_watch.py",)
T_SIMULATE = ("tests/symfric/integrator/test_simulate.py",)
T_ISOLATION = ("tests/symfric/integrator/running/test_isolation.py",)
T_EVENTS = ("tests/symfric/integrator/running/test_events.py",)
T_EMITTER = ("tests/symfric/emitter/test_emit.py",)
T_SOLVE = ("tests/ocp/test_solve.py",)
T_SHARPEN = ("tests/ocp/friction/test_homotopy.py",)

CONTROLLERS = (
    Mutant(
        "a step is accepted at ten times the tolerance", STEP,
        "accept = ca.logic_and(e2 <= 1, left > 0)", "accept = ca.logic_and(e2 <= 100, left > 0)",
        T_STEP,
    ),
    Mutant(
        "the controller does not look at the step before", STEP,
        "SAFETY * ca.fmin(growth, predicted)", "SAFETY * growth", T_STEP,
    ),
    Mutant(
        "a step grows right after a rejection", STEP,
        "ca.if_else(rejected > 0, ca.fmin(factor, 1), factor)",
        "ca.if_else(rejected > 2, ca.fmin(factor, 1), factor)", T_STEP,
    ),
    Mutant(
        "a step cut by the end forgets its size", STEP,
        "ca.if_else(h < h_wish, ca.fmax(h_wish, h * factor), h * factor)", "h * factor", T_STEP,
    ),
    Mutant("Newton's method stops far too early", STEP, "KAPPA = 0.1", "KAPPA = 50.0",
        ("tests/symfric/integrator/methods/test_radau.py",)),
    Mutant(
        "sliding is scaled by the faster end of a step", WATCH,
        "smallest = ca.fmin(", "smallest = ca.fmax(", T_WATCH,
    ),
    Mutant(
        "a step may carry a sliding velocity far across its scale", WATCH,
        "REACH = 4.0", "REACH = 400.0", T_WATCH,
    ),
    Mutant(
        "steps that are differentiated leap over the steep part of friction", WATCH,
        "REACH / self.finer", "REACH", ("tests/symfric/integrator/test_measured.py",),
    ),
    Mutant(
        "a step that turns back within is not seen to travel", WATCH,
        "bow = ca.fabs(half - (before + after) / 2)", "bow = 0 * half", T_WATCH,
    ),
    Mutant(
        "a longest step is not kept", STEP, "h_next = ca.fmin(h_max, ", "h_next = ca.fmin(np.inf, ",
        T_SIMULATE,
    ),
    Mutant(
        "an equation that returns NaN is accepted", STEP,
        "e2 = ca.if_else(sound, e2, 1e20)", "e2 = ca.if_else(sound, e2, 0)", T_STEP,
    ),
)  # fmt: skip

EVENT = (
    Mutant(
        "a falling event fires on the way up", CROSSINGS,
        "(before < 0) * (after >= 0) * (directions >= 0)", "(before < 0) * (after >= 0)",
        T_EVENTS,
    ),
    Mutant(
        "a step behind an event may be lost in t", EVENTS, ", SURE * abs(t))", ")", T_EVENTS,
    ),
    Mutant(
        "the virtual machine passes by steps with a possible event", EVENTS,
        "some = self._some[: len(part)] != 0", "some = self._some[: len(part)] > 1", T_ISOLATION,
    ),
    Mutant(
        "values before a step are those of the last step of a call", EVENTS,
        "self._ends[passed_by - 1]", "self._ends[-1]", T_EVENTS,
    ),
    Mutant(
        "no piece of a step is in doubt", CROSSINGS,
        "suspects, sure = doubts != 0,", "suspects, sure = doubts < 0,", T_ISOLATION,
    ),
    Mutant(
        "no piece of a step is in doubt in compiled code", SEARCH,
        "suspects[k][event] = doubts[k] != 0", "suspects[k][event] = f->left > 64", T_ISOLATION,
    ),
    Mutant(
        "compiled code takes bent pieces for straight ones", CROSSINGS,
        "STRAIGHT = 3.01", "STRAIGHT = 0.1", T_ISOLATION,
    ),
    Mutant(
        "outer pieces are never in doubt", CROSSINGS,
        "sizes[0] < first - noise", "sizes[0] < first - inf", T_ISOLATION,
    ),
    Mutant(
        "a piece before a sure root is taken for empty", CROSSINGS,
        "if at[k] >= sure:", "if sure <= 1:", T_ISOLATION,
    ),
    Mutant(
        "rounding is taken for crossings", CROSSINGS, "ROUNDING = 64 *", "ROUNDING = 0 *",
        ("tests/symfric/integrator/test_hybrid.py",),
    ),
    Mutant(
        "an expression that a jump leaves at zero counts as passed", EVENTS,
        "jumped = passed(self._before, g[0], self._directions) & (g[0] != 0)",
        "jumped = passed(self._before, g[0], self._directions)", T_EVENTS,
    ),
    Mutant(
        "what happens together happens one by one", EVENTS,
        "(found.roots - theta) * h <= self.tolerance", "found.roots == theta", T_EVENTS,
    ),
    Mutant(
        "the dense output of a cut step is not rescaled", CROSSINGS,
        "powers.append(powers[-1] * theta)", "powers.append(powers[-1])", T_EVENTS,
    ),
    Mutant(
        "an event fires again at once", EVENTS,
        "self._before[which] = np.nan", "self._before[which] *= 1.0", T_EVENTS,
    ),
    Mutant(
        "compiled code does not see an event that a reset causes", SEARCH,
        "M[PHASE] = JUMPED;", "M[PHASE] = FRESH;",
        ("tests/symfric/integrator/running/test_bits.py",),
    ),
)  # fmt: skip

CONSISTENT = (
    Mutant(
        "coordinates without a mass are not noticed", "symfric/multibody/checks.py",
        "least[0] < SINGULAR", "least[0] < -1.0", ("tests/symfric/multibody/urdf/test_read.py",),
    ),
    Mutant(
        "members go on without a look at the residual", INITIAL,
        "good = np.isfinite(size) & (near | (norm < before[todo]))", "good = np.isfinite(size)",
        ("tests/symfric/integrator/equations/test_initial.py",),
    ),
    Mutant(
        "unknowns stop while Newton's steps are still large", INITIAL,
        "NEAR, CONVERGED = 1e-4, 1e-10", "NEAR, CONVERGED = 1e-1, 1e-2",
        ("tests/symfric/integrator/equations/test_initial.py",),
    ),
)  # fmt: skip

TRANSCRIPTION = (
    Mutant(
        "the integral cost has the weights of another point", COLLOCATION,
        "scheme.weights[j],", "scheme.weights[j - 1],",
        T_SOLVE,
    ),
    Mutant(
        "what is asked for on the way is asked for at the start", "ocp/transcription/schemes.py",
        "bound[own.nodes[:, node]] = of(states, span.nodes[fraction])",
        "bound[own.nodes[:, node]] = of(states, span.nodes[0.0])", T_SOLVE,
    ),
    Mutant(
        "a miss counts as success", "ocp/checking/verify.py",
        "if verification.ok or not solution.status.ok:", "if True:", T_SOLVE,
    ),
    Mutant(
        "a jump to a motion that is worse is taken", "ocp/friction/homotopy.py",
        "if not step.good or step.outcome.cost > limit:", "if not step.good:", T_SHARPEN,
    ),
    Mutant(
        "layers are no narrower than in the step before", "ocp/friction/homotopy.py",
        "level = max(step.level / factor, last)", "level = max(0.9 * step.level, last)", T_SHARPEN,
    ),
)  # fmt: skip

EMIT = (
    Mutant(
        "operands lose their parentheses", "symfric/emitter/c99.py",
        "return self.text if self.binds >= least else", "return self.text if True else", T_EMITTER,
    ),
    Mutant(
        "the parts of a conditional change places", "symfric/foundation/graph.py",
        "return Node(SELECT, (yes.args[0], yes.args[1], no.args[1]))",
        "return Node(SELECT, (yes.args[0], no.args[1], yes.args[1]))",
        ("tests/symfric/foundation/test_graph.py",),
    ),
    Mutant(
        "a shared value is written out each time", STATEMENTS,
        "if uses[i] > 1 or (", "if (", T_EMITTER,
    ),
    Mutant(
        "locals take the names of arguments", EMITTER,
        'stem += "_"', "break", T_EMITTER,
    ),
    Mutant(
        "a pattern that repeats its operand counts once", STATEMENTS,
        "(operand, max(repeats, 1))", "(operand, 1)", T_EMITTER,
    ),
    Mutant(
        "a bool stands where a number is meant", "symfric/emitter/c99.py",
        "if not self.logical[i]:\n", "if True:\n", T_EMITTER,
    ),
    Mutant(
        "a parameter that spares a function stays variable", "symfric/codegen/blocks/variables.py",
        ">= least", ">= 0", ("tests/symfric/codegen/blocks/test_folding.py",),
    ),
    Mutant(
        "a held step goes beyond its place of rest", "symfric/codegen/blocks/held_step.py",
        "ca.logic_and(ratio > 0, ratio < 1)", "ca.logic_and(ratio > 0, ratio < 0)",
        ("tests/symfric/codegen/blocks/test_held_step.py",),
    ),
)  # fmt: skip

PIVOTS = "symfric/integrator/equations/matrices.py"
SUITED = "symfric/integrator/methods/method.py"
T_SUITED = ("tests/symfric/integrator/methods/test_suited.py",)
T_IMPLICIT = ("tests/symfric/integrator/equations/test_implicit.py",)

DIFFERENTIAL_ALGEBRAIC = (
    Mutant(
        "pivots are sound in one sample only", PIVOTS, "share = np.min(size", "share = np.max(size",
        ("tests/symfric/integrator/equations/test_pivots.py",),
    ),
    Mutant(
        "pivots stay, sound or not", SUITED, "if before <= SOUND or", "if True or", T_SUITED,
    ),
    Mutant(
        "pivots that fail on the way stay", RUN, "if reason is Stop.STEP_TOO_SMALL and self.",
        "if False and self.",
        T_SUITED,
    ),
    Mutant(
        "the smallest step is that of the whole span", INITIAL, "return 1e-15 * first_step(span)",
        "return 1e-15 * span", ("tests/symfric/integrator/equations/test_initial.py",),
    ),
    Mutant(
        "dependent equations are added instead of subtracted",
        "symfric/integrator/equations/system.py", "at_rest[i] - sum(", "at_rest[i] + sum(",
        T_IMPLICIT,
    ),
    Mutant(
        "charges jump where start values become consistent",
        "symfric/integrator/equations/matrices.py", "basis[pivots] = -B", "basis[pivots] = B",
        T_IMPLICIT,
    ),
    Mutant(
        "algebraic unknowns forget parameters in derivatives",
        "symfric/integrator/derivatives/saltation.py", "slope @ by_d + more)", "slope @ by_d)",
        ("tests/symfric/integrator/derivatives/test_sensitivity.py::"
         "test_algebraic_variables_follow_from_the_start_on",),
    ),
    Mutant(
        "drift is that of the start", "symfric/bench/ivp.py", "np.abs(at[name]).max()",
        "np.abs(at[name])[0]", ("tests/symfric/bench/test_ivp.py",),
    ),
)  # fmt: skip

MEMORY = "symfric/foundation/memory.py"
BUILT = "symfric/integrator/running/integrator.py"
KEPT = "symfric/integrator/compiled/compiler.py"
COMPILED = "symfric/integrator/compiled/compiler.py"
T_BUILT = ("tests/symfric/integrator/running/test_built.py",)
T_KEPT = ("tests/symfric/integrator/compiled/test_cache.py",)
T_COMPILED = ("tests/symfric/integrator/compiled/test_compiler.py",)

CACHES = (
    Mutant(
        "a storm is one a hundred times later", EVENTS, "c * c / (b - c) < 1000 * tolerance",
        "c * c / (b - c) < 10 * tolerance",
        ("tests/symfric/integrator/running/test_storm.py",),
    ),
    Mutant(
        "one key for all functions of time", "symfric/integrator/equations/inputs.py",
        "sha256(ca.SX.serialize(made).encode()).hexdigest()", '"function"',
        ("tests/symfric/integrator/equations/test_inputs.py",),
    ),
    Mutant(
        "integrators are never evicted", MEMORY, "del known[next(iter(known))]", "pass", T_BUILT
    ),
    Mutant(
        "one integrator for all methods", BUILT,
        "key = (method.name, method.finer, inputs.key)", "key = (inputs.key,)", T_BUILT,
    ),
    Mutant(
        "the processor is left out of the hash", COMPILED,
        "platform.machine(), processor()", "platform.machine()", T_COMPILED,
    ),
    Mutant(
        "the compiler is left out of the hash", COMPILED,
        "(compiler.command, flags, binary.st_size", "(flags, binary.st_size", T_COMPILED,
    ),
    Mutant("compiled code is never evicted", KEPT, "                    path.unlink()",
        "                    pass", T_KEPT),
    Mutant("the newest goes first", KEPT, "found.sort(reverse=True)", "found.sort()", T_KEPT),
    Mutant(
        "damaged code is loaded", KEPT,
        'whole = path.stem.endswith(f"-{_digest(path.read_bytes())}")', "whole = True", T_KEPT,
    ),
    Mutant(
        "code of others is loaded", KEPT,
        "return found.st_uid in (0, os.getuid()) and not", "return not", T_KEPT,
    ),
    Mutant(
        "the compiler fuses operations", COMPILED, '"-ffp-contract=off",', "",
        ("tests/symfric/integrator/running/test_bits.py",),
    ),
    Mutant(
        "outputs at a jump are those before it", "symfric/integrator/running/record.py",
        'side="right" if last else "left"', 'side="right"', T_OUTPUTS,
    ),
    Mutant(
        "the loop fills the end of a step, too", LOOP,
        "(last && time == row[1])", "time == row[1]", T_OUTPUTS,
    ),
    Mutant(
        "two runs share buffers", "symfric/integrator/running/integrator.py",
        "return self._spare.pop()", "return self._spare[-1]", T_OUTPUTS,
    ),
    Mutant(
        "a long run keeps its steps", "symfric/integrator/running/record.py",
        "if self._held > self.most:", "if False:", T_OUTPUTS,
    ),
    Mutant(
        "algebraic unknowns stay behind in compiled code", LOOP,
        "if (symfric_follow(L->S + MEM, L->R + GIVEN - $data)) return 7;", "",
        ("tests/symfric/integrator/running/test_bits.py::test_only_a_far_jump_is_searched_for",),
    ),
    Mutant(
        "settings of another kind are taken as checked", "symfric/integrator/simulate.py",
        "key = (*asked, *map(type, asked))", "key = asked",
        ("tests/symfric/integrator/test_settings.py",),
    ),
    Mutant(
        "the virtual machine ends with its batch", "symfric/integrator/running/engine.py",
        "took[used:] = False", "pass", ("tests/symfric/integrator/running/test_engine.py",),
    ),
)  # fmt: skip

LEFT_OUT = (
    Mutant(
        "the newest integrator is forgotten", MEMORY,
        "del known[next(iter(known))]", "del known[next(reversed(known))]", T_BUILT,
    ),
    Mutant(
        "code of a compiler that was replaced is loaded", COMPILED,
        "flags, binary.st_size, binary.st_mtime_ns)", "flags)", T_COMPILED,
    ),
    Mutant("code compiled with other flags is loaded", COMPILED, "(compiler.command, flags,",
        "(compiler.command,", T_COMPILED),
    Mutant(
        "gaps that grow again are a storm", EVENTS,
        "return b < a and c < b and", "return", T_EVENTS,
    ),
    Mutant(
        "pulses of inputs are leapt over", "symfric/integrator/equations/expressions.py",
        "if abs(level[i] - last) >= LEVELS:", "if abs(level[i] - last) >= 99:",
        ("tests/symfric/integrator/equations/test_onsets.py",),
    ),
)  # fmt: skip

MUTANTS = (
    *CONTROLLERS, *EVENT, *FITS, *CONSISTENT, *TRANSCRIPTION, *EMIT, *DIFFERENTIAL_ALGEBRAIC,
    *BESIDE,
    *CHOSEN, *CACHES, *COMPENSATED, *DEVICES, *DRY, *EMITTED, *ENSEMBLES, *EXPORTED,
    *GENERATED, *LEFT_OUT, *LOOPS, *DERIVATIVES, *MACHINES, *PICTURED, *PLANTS, *RESULTS, *ROBOTS,
    *HELD, *JUDGED, *SHOWN, *SOLVERS, *TOLD,
    *RANKED, *REFEREED, *WRITTEN,
)  # fmt: skip
