"""Mutants of what solves a discretised motion, and of what comes out of it."""

from mutants.mutant import Mutant

WATCH, PREPARED = "ocp/solving/watch.py", "ocp/solving/prepared.py"
OUTCOME, ANSWERS = "ocp/transcription/program.py", WATCH
CONVEXIFY, STAGES = "ocp/solving/methods.py", "ocp/transcription/program.py"
MOTION = STORED = "ocp/solving/motion.py"
STARTS, ONE = "ocp/solving/starts.py", "ocp/solving/one_solve.py"

T_FALLBACK = ("tests/ocp/friction/test_fallback.py",)
T_WATCH = ("tests/ocp/solvers/test_watch.py",)
T_IPOPT = ("tests/ocp/solvers/test_ipopt_runs.py",)
T_ANSWERS = ("tests/ocp/solvers/test_answers.py",)
T_SQP = ("tests/ocp/solvers/test_sqp.py",)
T_FATROP = ("tests/ocp/solvers/test_fatrop.py",)
T_STAGES = ("tests/ocp/transcription/test_stages.py",)
T_SOLVED = ("tests/ocp/result/test_solved.py",)
T_STORED = ("tests/ocp/result/test_stored.py",)
T_PICTURES = ("tests/ocp/result/test_pictures.py",)
T_POINTS = ("tests/ocp/solving/test_first_points.py",)
T_ONE = ("tests/ocp/solving/test_one_solve.py",)

SOLVERS = (
    Mutant(
        "the last iterate is kept in place of the best", WATCH,
        "if self.last.better_than(self.best):", "if True:", (*T_WATCH, *T_IPOPT),
    ),
    Mutant(
        "the cheapest iterate is the best, feasible or not", WATCH,
        "if max(self.violation, other.violation) <= FEASIBLE:", "if True:", T_WATCH,
    ),
    Mutant(
        "an iterate whose cost is NaN may be the best", WATCH,
        "return other is None or self.finite", "return True", T_WATCH,
    ),
    Mutant(
        "steps that shrink go round", WATCH,
        "moves = now > RESTING and now > 0.1 * before", "moves = now > RESTING", T_WATCH,
    ),
    Mutant(
        "a cost that falls goes round", WATCH,
        "return bool(moves and not closer and not cheaper)",
        "return bool(moves and not closer)", T_WATCH,
    ),
    Mutant(
        "nobody looks at the clock", WATCH,
        "perf_counter() > self._deadline", "perf_counter() < 0", T_IPOPT,
    ),
    Mutant(
        "an exception in progress stops nothing", WATCH,
        "self.error, self.halt = error, Halt.ERROR", "self.error = error", T_IPOPT,
    ),
    Mutant(
        "Ctrl-C stays caught", WATCH,
        "    finally:\n        signal.signal(signal.SIGINT, before)", "    finally:\n        pass",
        T_IPOPT,
    ),
    Mutant(
        "fatrop does not stop when told", WATCH,
        "slope = slope * np.nan", "pass", T_FATROP,
    ),
    Mutant(
        "bounds of unknowns are no violations", OUTCOME,
        "return float(max(rows, outside(w, program.lower_w, program.upper_w).max(initial=0.0)))",
        "return float(rows)", T_WATCH,
    ),
    Mutant(
        "a row that is NaN is none", OUTCOME,
        "return np.where(np.isfinite(values), far, np.inf)", "return np.nan_to_num(far)", T_WATCH,
    ),
    Mutant(
        "times of solves in a row are those of the last", OUTCOME,
        "solve_time=self.solve_time + later.solve_time", "solve_time=later.solve_time", T_WATCH,
    ),
    Mutant(
        "other numbers of the parameters are not taken", PREPARED,
        "numbers = program.values if values is None else", "numbers = program.values if True else",
        T_ONE,
    ),
    Mutant(
        "a start with multipliers is taken for a cold one", "ocp/solving/methods.py",
        "(WARM if warm else {})", "{}", T_ONE,
    ),
    Mutant(
        "more equations than unknowns go to the solver", PREPARED,
        "if _equations(program) > program.w.numel():", "if False:", T_IPOPT,
    ),
    Mutant(
        "a bound is told as a row", ANSWERS,
        "if rows.max(initial=0.0) >= far:", "if True:", T_ANSWERS,
    ),
    Mutant(
        "what all intervals have in common is counted in each", CONVEXIFY,
        "share[:, own:, own:] = 1.0 / parts", "share[:, own:, own:] = 1.0", T_SQP,
    ),
    Mutant(
        "negative eigenvalues stay", CONVEXIFY,
        "values = np.maximum(values, FLOOR", "values = np.maximum(values, -np.inf + FLOOR", T_SQP,
    ),
    Mutant(
        "a free duration is no matter to stages", STAGES,
        "if any(span.T >= 0 for span in layout.spans):", "if False:", T_STAGES,
    ),
    Mutant(
        "rows that know other intervals are in stages", STAGES,
        "if wrong.any():", "if False:", T_STAGES,
    ),
)  # fmt: skip

RESULTS = (
    Mutant(
        "every joint is there twice", MOTION,
        "not pieces[k + 1].jumps", "False", T_SOLVED,
    ),
    Mutant(
        "algebraic variables at a node are those behind its first point", MOTION,
        "blocks @ scheme.inner_ends", "blocks[:, :, 0]", T_SOLVED,
    ),
    Mutant(
        "a phase starts at zero", MOTION, "begin += points[k].T", "begin += 0.0", T_SOLVED,
    ),
    Mutant(
        "a stored problem forgets its phases", "ocp/formulation/problem.py",
        "        problem.spans,\n", "        problem.spans[:1],\n",
        T_STORED,
    ),
    Mutant(
        "states between the points are no polynomials", STORED,
        "weights[i] *= (s - other) / (node - other)", "weights[i] *= (s - other)", T_STORED,
    ),
    Mutant(
        "the end of a phase is not its last value", STORED,
        "return np.where(fractions >= 1.0, ends[-1], values)", "return values * 1.01",
        (*T_STORED, *T_POINTS),
    ),
    Mutant(
        "a band of modes covers those of other contacts", "ocp/solving/picture.py",
        "(k + 1) / count,", "1.0,", T_PICTURES,
    ),
    Mutant(
        "velocities start at rest", STARTS,
        "for rate, name in rates_of(span.model).items():", "for rate, name in ():", T_POINTS,
    ),
    Mutant(
        "durations do not add up", STARTS, "found[n] * rest / have", "found[n]", T_POINTS,
    ),
    Mutant(
        "a state jumps nowhere", STARTS,
        "knots[self._begin[run[0]]] = self._landing(run[0], jump)", "pass", T_POINTS,
    ),
    Mutant(
        "multipliers of another program are used", STARTS,
        "and stored.structure == structure_of(into.problem, into.scheme)", "and True", T_POINTS,
    ),
    Mutant(
        "a free duration is not carried over", STARTS,
        "durations[number] = float(np.clip(source.T, span.T.lower, span.T.upper))", "pass",
        T_POINTS,
    ),
    Mutant(
        "perturbations grow with their waves", "ocp/solving/one_solve.py",
        "* size / np.sqrt(WAVES)", "* size", T_POINTS,
    ),
    Mutant(
        "times of places start anew in each phase", "ocp/transcription/transcription.py",
        "{begin + place.fraction", "{place.fraction", T_ONE,
    ),
    Mutant(
        "contacts that never turn round are blamed", "ocp/solving/one_solve.py",
        "if turns and 0.0 < width", "if 0.0 < width", ("tests/ocp/solving/test_kinks.py",),
    ),
    Mutant(
        "one mode asks for the reactions of another", "ocp/friction/mode_models.py",
        "for v in moving.z}", "for v in held.z}", T_FALLBACK,
    ),
    Mutant(
        "what fails among modes is raised", "ocp/strategies.py",
        'said = f"Modes were not found: {_reason(error)}."', "raise", T_FALLBACK,
    ),
    Mutant(
        "rests keep one margin whatever was asked for", "ocp/friction/arcs.py",
        "LEVEL if side == open_side else margin", "LEVEL if side == open_side else MARGIN",
        ("tests/ocp/friction/test_resting_margin.py",),
    ),
    Mutant(
        "meshes are looked at where they are used", "ocp/solve.py",
        "    if intervals is not None:\n", "    if False:\n", ("tests/ocp/test_arguments.py",),
    ),
    Mutant(
        "costs are as large as they are", "ocp/solve.py",
        "1.0 / cost_size(posed)", "1.0", ("tests/ocp/formulation/test_sizes.py",),
    ),
    Mutant(
        "a nominal value that was given gives way", "ocp/formulation/problem.py",
        "(v.nominal == UNSAID and times >= FAR)", "times >= FAR",
        ("tests/ocp/formulation/test_sizes.py",),
    ),
)  # fmt: skip
