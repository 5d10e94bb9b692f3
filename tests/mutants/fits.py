"""Mutants of fits: from files over residuals and their minimum to what is said of it."""

from mutants.mutant import Mutant

DATA, UNKNOWNS = "identification/data/", "identification/unknowns/"
RESIDUALS, SOLVING = "identification/residuals/", "identification/solving/"
VERDICT, RESULT = "identification/verdict/", "identification/result/"
STARTS = "identification/starts/"

TESTS = "tests/identification/"
T_UNITS = (f"{TESTS}data/test_units.py",)
T_DATASET = (f"{TESTS}data/test_dataset.py",)
T_MERGE = (f"{TESTS}data/test_merge.py",)
T_FAULTS = (f"{TESTS}data/test_check_faults.py",)
T_GOOD = (f"{TESTS}data/test_check_good_records.py",)
T_FILTERS = (f"{TESTS}data/test_signals_filters.py",)
T_DIFFERENTIATE = (f"{TESTS}data/test_differentiate.py",)
T_VELOCITY = (f"{TESTS}data/test_velocity.py",)
T_REGRESS = (f"{TESTS}data/test_signals_regress.py",)
T_UNKNOWNS = (f"{TESTS}unknowns/test_unknowns.py",)
T_SUBJECT = (f"{TESTS}unknowns/test_subject.py",)
T_POINTS = (f"{TESTS}residuals/test_points.py",)
T_INVERSE = (f"{TESTS}residuals/test_inverse.py",)
T_IMPOSED = (f"{TESTS}residuals/test_imposed.py",)
T_WINDOWS = (f"{TESTS}residuals/test_windows.py",)
T_SHOOTING = (f"{TESTS}residuals/test_shooting.py",)
T_INITIAL = (f"{TESTS}residuals/test_initial.py",)
T_CLOSED = (f"{TESTS}residuals/test_closed_loop.py",)
T_OPEN = (f"{TESTS}residuals/test_open_loop.py",)
T_STARTS = (f"{TESTS}solving/test_many_starts.py",)
T_SCATTER = (f"{TESTS}solving/test_scatter.py",)
T_COLOUR = (f"{TESTS}verdict/test_colour.py",)
T_SANDWICH = (f"{TESTS}verdict/test_sandwich.py",)
T_COVARIANCE = (f"{TESTS}verdict/test_covariance.py",)
T_INDEPENDENCE = (f"{TESTS}verdict/test_independence.py",)
T_JUDGE = (f"{TESTS}verdict/test_judge.py",)
T_FITTED = (f"{TESTS}result/test_fitted.py",)
T_CODING = (f"{TESTS}result/test_coding.py",)
T_STRIBECK = (f"{TESTS}starts/test_stribeck_start.py",)
T_SLIDING = (f"{TESTS}starts/test_pre_sliding.py",)

MEASURED = (
    Mutant(
        "units behind a slash multiply", "symfric/foundation/units.py",
        "size *= factor[0] ** sense", "size *= factor[0]", T_UNITS,
    ),
    Mutant(
        "a bracket behind a slash is not turned round", "symfric/foundation/units.py",
        "powers.get(symbol, 0) + sense * power", "powers.get(symbol, 0) + power", T_UNITS,
    ),
    Mutant(
        "gaps of a record are bridged", DATA + "record.py", "GAP = 5.0", "GAP = 5e9", T_DATASET,
    ),
    Mutant(
        "gaps of the second recorder are bridged", DATA + "merge.py",
        "& (t[k + 1] - t[k] <= GAP * second.median_step)", "", T_MERGE,
    ),
    Mutant(
        "a clock that runs faster is corrected the wrong way", DATA + "merge.py",
        "return t - self.shift - self.drift *", "return t - self.shift + self.drift *", T_MERGE,
    ),
    Mutant(
        "clipping is seen from a fifth of the samples on", DATA + "check_signals.py",
        "RUN, SHARE = 5, 0.002", "RUN, SHARE = 5, 0.2", T_FAULTS,
    ),
    Mutant(
        "a step is a spike", DATA + "check_signals.py",
        "(off > limit) & (off > BACK * through)", "off > limit", T_GOOD,
    ),
    Mutant(
        "an encoder is lost after a thousand equal values", DATA + "check_signals.py",
        "FROZEN = 8", "FROZEN = 1000", T_FAULTS,
    ),
    Mutant(
        "the low pass has half its order", DATA + "filters.py",
        "gain = 1 / (1 + ratio ** (2 * order))", "gain = 1 / (1 + ratio**order)", T_FILTERS,
    ),
    Mutant(
        "accelerations are differences of differences", DATA + "differentiate.py",
        "a[1:-1] = (x[2:] - 2 * x[1:-1] + x[:-2]) / step**2",
        "a = central_difference(central_difference(x, step), step)", T_DIFFERENTIATE,
    ),
    Mutant(
        "what the low pass mixes with a reversal stays", DATA + "differentiate.py",
        "around = ceil(0.5 / (filter.cutoff * step))", "around = 0", T_DIFFERENTIATE,
    ),
    Mutant(
        "noise of the velocity is that before the low pass", DATA + "filters.py",
        "np.mean(gain**2 * self.noise[inside])", "np.mean(self.noise[inside])", T_VELOCITY,
    ),
    Mutant(
        "the noisier one of two velocities weighs more", DATA + "filters.py",
        "weight = np.divide(of_x, both", "weight = np.divide(of_v, both", T_VELOCITY,
    ),
    Mutant(
        "a difference of positions falls short of nothing", DATA + "filters.py",
        "deficit = 1 - np.sinc(2 * frequency)", "deficit = 0 * frequency", T_VELOCITY,
    ),
    Mutant(
        "Coulomb friction and offset are one column", DATA + "differentiate.py",
        '"offset": np.ones_like(v)', '"offset": sign', T_REGRESS,
    ),
)  # fmt: skip

COORDINATES = (
    Mutant(
        "static friction may fall below the dynamic one", UNKNOWNS + "unknowns.py",
        "        if not unknown.logarithmic:\n            return 0.0, inf",
        "        if not unknown.logarithmic:\n            return -inf, inf", T_SUBJECT,
    ),
    Mutant(
        "log(...) fits the value itself", UNKNOWNS + "spec.py",
        'return _range("log", low, upper, start, True)',
        'return _range("log", low, upper, start, False)', T_SUBJECT,
    ),
    Mutant(
        "a tie forgets its factor", UNKNOWNS + "spec.py",
        "return Tied(_Multiple(to, times))", "return Tied(_Multiple(to, 1.0))", T_SUBJECT,
    ),
    Mutant(
        "upper bounds are never reached", UNKNOWNS + "unknowns.py",
        " | (high - w < near)", "", T_UNKNOWNS,
    ),
)  # fmt: skip

KINDS = (
    Mutant(
        "points are predicted with the wrong sign", RESIDUALS + "points.py",
        "table.weights * (found[0] + shift.sum() - table.F)",
        "table.weights * (table.F - found[0] - shift.sum())", T_POINTS,
    ),
    Mutant(
        "break-away is that of the other direction", RESIDUALS + "points.py",
        "levels[0], -levels[1]", "levels[0], -levels[0]", T_POINTS,
    ),
    Mutant(
        "the dead time of all records is that of the first", RESIDUALS + "inverse.py",
        "J[:, count + number] = rates", "J[:, count] = rates", T_INVERSE,
    ),
    Mutant(
        "bristles of a record that begins in motion are relaxed", RESIDUALS + "sampled.py",
        "NEAR_REST = 0.05", "NEAR_REST = 5e9", T_IMPOSED,
    ),
    Mutant(
        "windows overlap by a sample", RESIDUALS + "initial.py",
        "slice(a, b) for a, b", "slice(a, b + 1) for a, b", T_WINDOWS,
    ),
    Mutant(
        "windows start where the model says", RESIDUALS + "preparation.py",
        'if given == "given" and k == 0:', 'if given == "given":', T_SHOOTING,
    ),
    Mutant(
        "derivatives by the dead time have the wrong sign", RESIDUALS + "shots.py",
        "new = old - theta.symbol", "new = old + theta.symbol", T_SHOOTING,
    ),
    Mutant(
        "a dead time lets inputs come early", RESIDUALS + "shots.py",
        "late = self.t[first:last] + tau", "late = self.t[first:last] - tau", T_SHOOTING,
    ),
    Mutant(
        "start values believe in more noise than there is", RESIDUALS + "initial.py",
        "/ comb(2 * k, k)", "/ comb(2 * k, 1)", T_INITIAL,
    ),
    Mutant(
        "the controller has no limit", RESIDUALS + "closed_loop.py",
        "command = ca.fmin(ca.fmax(command, -loop.limit), loop.limit)", "command = 1 * command",
        T_CLOSED,
    ),
    Mutant(
        "the disturbance enters behind the gain", RESIDUALS + "closed_loop.py",
        "self.gain * (new[-1].value + row[len(self.reference)])",
        "self.gain * new[-1].value + row[len(self.reference)]", T_CLOSED,
    ),
    Mutant(
        "derivatives forget what the controller remembers", RESIDUALS + "closed_loop.py",
        "slope = _times(by_s, memory) + _times(by_y, seen)", "slope = _times(by_y, seen)", T_CLOSED,
    ),
    Mutant(
        "the controller believes that the drive rested before", RESIDUALS + "closed_loop.py",
        "before = ca.vertcat(xv[0] - step * xv[1], xv[0] - 1.5 * step * xv[1])",
        "before = ca.vertcat(xv[0], xv[0])", T_CLOSED,
    ),
    Mutant(
        "all records start where the first one does", RESIDUALS + "closed_loop.py",
        "mine = count + 2 * k", "mine = count", T_CLOSED,
    ),
    Mutant(
        "derivatives forget that friction sets the length of a step", RESIDUALS + "stepper.py",
        " + a * S_slope) / steep", ") / steep", T_OPEN,
    ),
    Mutant(
        "inputs that are held are linear between samples", RESIDUALS + "open_loop.py",
        "np.zeros_like(dt) if held else", "np.diff(samples) / dt if held else", T_OPEN,
    ),
)  # fmt: skip

MINIMA = (
    Mutant(
        "noise levels do not count what the fit has taken", SOLVING + "task.py",
        "max(r.size - shares[signal], 1.0)", "max(r.size, 1.0)", T_STARTS,
    ),
    Mutant(
        "noise costs half of its logarithm", SOLVING + "task.py",
        "sum(2 * n * log(task.noise[s])", "sum(n * log(task.noise[s])", T_STARTS,
    ),
    Mutant(
        "derivatives forget the loss", SOLVING + "task.py",
        "(de / self.sigma)[:, None]", "(1 / self.sigma)[:, None]", T_STARTS,
    ),
    Mutant(
        "outliers weigh as much as all others in Huber's loss", SOLVING + "task.py",
        "np.where(z <= 1, z, 2 * root - 1), 1 / root", "z, np.ones_like(z)", T_STARTS,
    ),
    Mutant(
        "a block of rows forgets those before it", SOLVING + "task.py",
        "np.vstack([found, columns[first : first + size]])", "columns[first : first + size]",
        T_STARTS,
    ),
    Mutant(
        "starts have no seed", SOLVING + "many_starts.py",
        "np.random.default_rng(seed)", "np.random.default_rng()", T_SCATTER,
    ),
    Mutant(
        "one start agrees with itself", SOLVING + "many_starts.py",
        "if len(same) >= agree:", "if len(same) >= 1:", T_STARTS,
    ),
    Mutant(
        "starts that end elsewhere agree", SOLVING + "many_starts.py",
        "s.status.ok and s.objective - best.objective < SAME", "s.status.ok", T_STARTS,
    ),
    Mutant(
        "residuals are white if neighbours are", SOLVING + "many_starts.py",
        "for lag in (1, 2, 4):", "for lag in (1,):", T_STARTS,
    ),
    Mutant(
        "the last trial is the end, better or not", SOLVING + "descent.py",
        "if self.last.cost < self.best.cost:", "if True:", T_STARTS,
    ),
    Mutant(
        "what a bound holds could still be gained", SOLVING + "descent.py",
        "free = ~((low & (g > 0)) | (near & ~low & (g < 0)))", "free = g == g", T_STARTS,
    ),
)  # fmt: skip

JUDGED = (
    Mutant(
        "whiteness pays for the unknowns of the model", VERDICT + "colour.py",
        "float(chdtrc(len(lags), statistic))", "float(chdtrc(max(len(lags) - k, 1), statistic))",
        T_INDEPENDENCE,
    ),
    Mutant(
        "noise goes round from the end of a record to its start", VERDICT + "covariance.py",
        "points = 1 << (2 * on_grid.shape[0]).bit_length()", "points = on_grid.shape[0]",
        T_SANDWICH,
    ),
    Mutant(
        "that the colour is an estimate does not count", VERDICT + "covariance.py",
        "return C, 2 * np.diag(C) ** 2 / found.freedom + spread",
        "return C, 2 * np.diag(C) ** 2 / found.freedom", T_SANDWICH,
    ),
    Mutant(
        "what the fit could still take up counts as dependence", VERDICT + "independence.py",
        "clean = _without(known, whitened(columns, partial, position))",
        "clean = whitened(columns, partial, position)", T_INDEPENDENCE,
    ),
    Mutant(
        "dependence is tested as if residuals were white", VERDICT + "independence.py",
        "rest = _without(known, whitened(r, partial, position))",
        "rest = _without(known, r)", T_INDEPENDENCE,
    ),
    Mutant(
        "correlated samples count as more than they are", VERDICT + "colour.py",
        "slow = 1 / (1 - float(self.phi.sum())) ** 2", "slow = 1 / (1 - float(self.phi.sum()))",
        T_COLOUR,
    ),
    Mutant(
        "coloured residuals are measured by all their rows", VERDICT + "judge.py",
        "free = max(colour.effective * colour.freedom / colour.rows, 1.0)",
        "free = max(colour.freedom, 1.0)", T_INDEPENDENCE,
    ),
    Mutant(
        "every test may cry out for itself", VERDICT + "judge.py",
        "ALARM / max(count, 1)", "ALARM", T_INDEPENDENCE,
    ),
    Mutant(
        "a wrong model is no doubt", VERDICT + "judge.py",
        "if self.nonsense else Status.DOUBTFUL", "if self.nonsense else solved", T_JUDGE,
    ),
    Mutant(
        "a mass at its lower bound is physics", VERDICT + "judge.py",
        "if held and unknown.unit in INERTIA and near:", "if False:",
        T_JUDGE,
    ),
    Mutant(
        "intervals hold 90 %", VERDICT + "covariance.py",
        "stdtrit(freedom, 0.5 + LEVEL / 2)", "stdtrit(freedom, LEVEL)", T_COVARIANCE,
    ),
)  # fmt: skip

STORED = (
    Mutant(
        "the ends of an interval change places", RESULT + "build.py",
        "made.low, made.high, made.white_errors", "made.high, made.low, made.white_errors",
        T_FITTED,
    ),
    Mutant(
        "JSON holds numbers that are not finite", RESULT + "stored.py",
        "return str(value) if value in (inf, -inf) else value", "return value", T_CODING,
    ),
    Mutant(
        "fits of other versions are read", RESULT + "stored.py",
        'if data.get("format") != FORMAT:', "if False:", (f"{TESTS}result/test_stored.py",),
    ),
)  # fmt: skip

FIRST = (
    Mutant(
        "only the slowest Stribeck velocity is tried", STARTS + "stribeck.py",
        "tried[int(np.argmin([cost for *_, cost in tried]))]", "tried[0]", T_STRIBECK,
    ),
    Mutant(
        "bins have means", STARTS + "stribeck.py",
        "middle = float(np.median(F))", "middle = float(np.mean(F))", T_STRIBECK,
    ),
    Mutant(
        "elements slip within a hundredth of the travel", STARTS + "maxwell_slip.py",
        "travel / 2, CANDIDATES)", "travel / 100, CANDIDATES)", T_SLIDING,
    ),
    Mutant(
        "every record begins without load", STARTS + "maxwell_slip.py",
        "for loaded in (0, 1, -1)", "for loaded in (0, 0, 0)", T_SLIDING,
    ),
    Mutant(
        "Coulomb friction is the smallest force", STARTS + "six_steps.py",
        "F_C = max(F_min - sigma_2 * v_min, 0.0)", "F_C = max(F_min, 0.0)", T_STRIBECK,
    ),
    Mutant(
        "points of the exponential part weigh alike", STARTS + "six_steps.py",
        "1, w=weight * power)", "1)", T_STRIBECK,
    ),
    Mutant(
        "what came before a ramp counts to its rate", STARTS + "measured.py",
        "rising[: last[-1] + 1 if last.size else 0] = False", "rising[:0] = False", T_SLIDING,
    ),
)  # fmt: skip

COMPARED = (
    Mutant(
        "a parameter costs half of what it should", "identification/select.py",
        "k * float(np.log(n))", "k * float(np.log(n)) / 2", (f"{TESTS}test_select.py",),
    ),
    Mutant(
        "noise under a robust loss is that of its outliers", SOLVING + "task.py",
        "NORMAL * float(np.median(np.abs(r)))", "float(np.std(r))", T_STARTS,
    ),
    Mutant(
        "the sampled engine takes inputs early", RESIDUALS + "shots.py",
        "instants - tau)", "instants + tau)", (f"{TESTS}residuals/test_sampled_shots.py",),
    ),
    Mutant(
        "the largest error is the largest above", RESULT + "series.py",
        "float(np.abs(left).max(initial=0.0))", "float(left.max(initial=0.0))", T_FITTED,
    ),
    Mutant(
        "noise counts to the bandwidth of a force", DATA + "filters.py",
        "np.cumsum(power - noise)", "np.cumsum(power)", T_FILTERS,
    ),
    Mutant(
        "what stands at a bound widens the intervals of others", VERDICT + "covariance.py",
        "free = ~found.held\n    size", "free = ~found.held | True\n    size", T_SANDWICH,
    ),
    Mutant(
        "outliers tell as much as other samples", VERDICT + "minimum.py",
        "gain[rows] = max(float(np.mean(above[rows] - below[rows])) / (2 * h), 0.05)",
        "gain[rows] = 1.0", T_JUDGE,
    ),
    Mutant(
        "a dependence counts however small it is", VERDICT + "judge.py",
        " or d.share < SHARE", "", T_JUDGE,
    ),
    Mutant(
        "a signal that is mostly noise is no physics", VERDICT + "judge.py",
        "if 1 - left / there < CHANCE * by_chance:", "if True:", T_JUDGE,
    ),
)  # fmt: skip

FITS = (*MEASURED, *COORDINATES, *KINDS, *MINIMA, *JUDGED, *STORED, *FIRST, *COMPARED)
