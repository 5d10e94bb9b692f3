"""Mutants of what stands round generated C: guards, data sheet, kit, proof."""

from mutants.mutant import Mutant

GUARDS = "symfric/codegen/guards.py"
GUARDS_C = "symfric/codegen/templates/guards.c"
SHEET, HEADER = "symfric/codegen/header.py", "symfric/codegen/header.py"
VECTORS, LOADER = "symfric/codegen/vectors.py", "symfric/codegen/templates/ctypes_loader.txt"
SELF, SIMULINK = "symfric/codegen/kit.py", "symfric/codegen/kit.py"
MANIFEST = "symfric/codegen/generated.py"
COMPARED = "symfric/codegen/compared.py"
MAGNITUDE = "symfric/codegen/compared.py"
VERIFY, FUZZ = "symfric/codegen/verification.py", "symfric/codegen/fuzz.py"
EXCITATION = "symfric/codegen/compared.py"
GUARDED = "symfric/codegen/runner.py"
T_SOURCE = "tests/symfric/codegen/test_source.py"
T_GUARDS = "tests/symfric/codegen/test_guards.py"
T_FLAGGED = (f"{T_GUARDS}::test_every_repair_is_flagged",)
T_EVERY = (f"{T_GUARDS}::test_numbers_of_every_range_are_mended_in_c_as_beside_casadi",)
T_RANGES = (f"{T_GUARDS}::test_ranges_are_the_bounds_or_a_million_times_the_nominal_value",)
T_INTERVAL = (f"{T_SOURCE}::test_a_range_is_where_all_numbers_of_a_member_are_valid",)
T_DEFAULTS = (f"{T_SOURCE}::test_defaults_of_an_array_that_differ_are_its_ends",)
T_VECTORS = "tests/symfric/codegen/test_vectors.py"
T_MANIFEST = "tests/symfric/codegen/test_generate.py"
T_LOADER = "tests/symfric/codegen/test_loader.py"
T_SIMULINK = ("tests/symfric/codegen/test_simulink.py",)
T_SELF = "tests/symfric/codegen/test_unit_test.py"
T_VERIFY = "tests/symfric/codegen/test_verify.py"
T_FUZZ = "tests/symfric/codegen/test_fuzz.py"


def compared(test: str) -> tuple[str, ...]:
    """A test of what differences are measured in, without `test_`."""
    return (f"tests/symfric/codegen/test_compared.py::test_{test}",)


GENERATED = (
    Mutant(
        "guards: minus zero is no load", GUARDS_C, "> span && x != low;", "> span;", T_EVERY,
    ),
    Mutant(
        "guards: the end of a range is outside", GUARDS_C,
        "& @magnitude) > @{name}_bits(limit);", "& @magnitude) >= @{name}_bits(limit);", T_EVERY,
    ),
    Mutant(
        "guards: infinity is clamped", GUARDS_C,
        "& @magnitude) >= @infinite) {", "& @magnitude) > @infinite) {", T_FLAGGED,
    ),
    Mutant(
        "guards: a range of unequal ends is as wide as its wider one", GUARDS,
        ' || {place} < {least} || {place} > {most}"', '"', T_EVERY,
    ),
    Mutant(
        "guards: what is no number becomes zero, which may be out of range", GUARDS,
        "min(max(start, variable.lower), variable.upper))", "0.0)", T_RANGES,
    ),
    Mutant(
        "guards: a default out of the usual range is refused", GUARDS,
        "Range(min(SHORTEST, start), max(LONGEST, start), start)",
        "Range(SHORTEST, LONGEST, start)", T_RANGES,
    ),
    Mutant(
        "guards: an absurd state is one far from its nominal value only", GUARDS,
        "HUGE * max(variable.nominal, abs(float(variable.start)))", "HUGE * variable.nominal",
        T_RANGES,
    ),
    Mutant(
        "guards: ranges end beyond what float can square", GUARDS,
        "return Range(low, min(high, TOP), safe)", "return Range(low, high, safe)", T_RANGES,
    ),
    Mutant(
        "guards: states go on after a result that was none", GUARDS,
        'restart = [f"    *state = {name}_start;"] if block.states else []', "restart = []",
        T_EVERY,
    ),
    Mutant(
        "guards: of an array the first element alone is looked at", GUARDS,
        "for (i = 0; i < {member.size}; i++)", "for (i = 0; i < 1; i++)", T_EVERY,
    ),
    Mutant(
        "guards: NumPy forgets the status of the step size", GUARDED,
        "int(Status.PARAMETER) if unfit.any() else 0",
        "int(Status.PARAMETER) if unfit[~is_size].any() else 0", T_EVERY,
    ),
    Mutant(
        "sheet: an array's range is that of its widest element", SHEET,
        "low, high = max(low for low, _ in ends), min(high for _, high in ends)",
        "low, high = min(low for low, _ in ends), max(high for _, high in ends)", T_INTERVAL,
    ),
    Mutant(
        "sheet: without guards the ranges of guards are promised", SHEET,
        'if guards and group != "state":', 'if group != "state":', T_INTERVAL,
    ),
    Mutant(
        "sheet: a range with one end has none", SHEET,
        'return f">= {low:g}"', 'return ""', T_INTERVAL,
    ),
    Mutant(
        "sheet: defaults that differ are called the first one", HEADER,
        'starts if len(starts) < 2 else [starts[0], "...", starts[-1]]', "starts[:1]", T_DEFAULTS,
    ),
    Mutant(
        "kit: tolerances do not know what rounding changes", VECTORS,
        "ROUNDINGS * usual)", "0 * usual)", (T_VECTORS,),
    ),
    Mutant(
        "kit: rows that rounding takes out of the tolerance stay", VECTORS,
        "return np.all(ROUNDINGS / 2 * spread <= tolerance, axis=1)",
        "return np.full(len(spread), True)", (T_VECTORS,),
    ),
    Mutant(
        "kit: a parameter is changed where it matters least", VECTORS,
        "np.argsort(np.where(fit, effect, -1.0))[::-1][:EACH]",
        "np.argsort(np.where(fit, effect, np.inf))[:EACH]", (T_VECTORS,),
    ),
    Mutant(
        "kit: a parameter is changed beyond its bound", VECTORS,
        "return start + step if start + step <= variable.upper else start - step",
        "return start + step", (T_VECTORS,),
    ),
    Mutant(
        "kit: rows are numbers that the type does not have", VECTORS,
        "states = real.rounded(np.vstack([start, after[:-1, :count]]))",
        "states = np.vstack([start, after[:-1, :count]])", (T_VECTORS,),
    ),
    Mutant(
        "kit: NaN passes the unit test", "symfric/codegen/templates/test.c",
        "return !(fabs@letter(got - wanted) <= tolerance);",
        "return fabs@letter(got - wanted) > tolerance;",
        (f"{T_SELF}::test_a_result_that_is_no_number_is_wrong",),
    ),
    Mutant(
        "kit: the unit test does not look at the status", SELF,
        '["failures += status != vector->status;"] * guards', "[]",
        (f"{T_SELF}::test_a_wrong_default_status_or_parameter_is_found",),
    ),
    Mutant(
        "kit: the loader gives the status of the last step", LOADER,
        "int(np.bitwise_or.reduce(status, initial=0))", "int(status[-1])",
        (f"{T_LOADER}::test_guards_speak_through_the_status",),
    ),
    Mutant(
        "kit: the loader forgets the parameters that it is given", LOADER,
        '            self._fill(self.param, parameters)\n', "",
        (f"{T_LOADER}::test_parameters_start_values_and_resets_are_those_of_the_c",),
    ),
    Mutant(
        "kit: the manifest has the bounds of the law, not those of the guards", MANIFEST,
        "if within is None else (within.low, within.high)",
        "if True else (within.low, within.high)",
        (f"{T_MANIFEST}::test_the_manifest_has_the_ranges_that_are_kept",),
    ),
    Mutant(
        "kit: the S-function steps when it shows its outputs", SIMULINK,
        "ssGetRWork(S)[{i}] = (real_T){place};", "ssGetRealDiscStates(S)[{i}] = (real_T){place};",
        T_SIMULINK,
    ),
    Mutant(
        "kit: the S-function has its own step size", SIMULINK,
        'lines.append(f"param.h = {cast}mxGetScalar(ssGetSFcnParam(S, 0));")', "pass", T_SIMULINK,
    ),
    Mutant(
        "proof: a difference of large numbers is judged by what is left", MAGNITUDE,
        "return ca.fmax(m[0], m[1])", "return ca.fabs(own[0] + own[1])",
        compared("a_difference_has_the_magnitude_of_its_larger_term"),
    ),
    Mutant(
        "proof: the residual of closing equations is a force", MAGNITUDE,
        "if kind == CONSTRAINTS]", "if False]",
        compared("closing_equations_have_that_of_all_that_went_into_them"),
    ),
    Mutant(
        "proof: the signal with the largest numbers is the worst", COMPARED,
        "int(np.argmax(self.relative))", "int(np.argmax(np.abs(self.expected)))",
        compared("the_worst_signal_is_the_one_that_is_off_by_most_of_its_magnitude"),
    ),
    Mutant(
        "proof: rounding is what moves the first signal", COMPARED,
        "made[:, 0, column][np.isfinite(made[:, 0, column])]",
        "made[:, 0, 0][np.isfinite(made[:, 0, 0])]",
        compared("the_worst_signal_is_the_one_that_is_off_by_most_of_its_magnitude"),
    ),
    Mutant(
        "proof: NaN where CasADi has a number is no difference", COMPARED,
        "np.where(np.isnan(ratio), np.inf, ratio)", "np.where(np.isnan(ratio), 0.0, ratio)",
        (f"{T_VERIFY}::test_not_a_number_is_found",),
    ),
    Mutant(
        "proof: numbers on both sides of zero are neighbours", COMPARED,
        "np.where(bits < 0, np.iinfo(np.int64).min - bits, bits)", "np.abs(bits)",
        compared("last_places_are_counted_across_zero"),
    ),
    Mutant(
        "proof: the warnings of a compiler are no failure", VERIFY,
        "return self.near and not self.warnings and not", "return self.near and not",
        (f"{T_VERIFY}::test_a_warning_is_found",),
    ),
    Mutant(
        "proof: a load never vanishes", EXCITATION,
        "LOADS = (1.0, 10.0, 0.1, 1.5, 0.0, 1.0, 1e-3, 6.0, 0.5, 0.0, 100.0, 1.0)",
        "LOADS = (1.0, 10.0, 0.1, 1.5, 1.0, 1.0, 1e-3, 6.0, 0.5, 1.0, 100.0, 1.0)",
        (f"{T_VERIFY}::test_inputs_hold_zeros_reversals_tiny_and_large_velocities",),
    ),
    Mutant(
        "proof: step sizes are tried over one decade", EXCITATION,
        "10.0 ** random.uniform(-3.0, 0.0, stretches)",
        "10.0 ** random.uniform(-1.0, 0.0, stretches)",
        (f"{T_VERIFY}::test_other_parameters_hold_step_sizes_over_three_decades",),
    ),
    Mutant(
        "proof: absurd numbers are tried in one input", EXCITATION,
        "random.uniform(size=inputs.shape) < 0.05",
        "random.uniform(size=(len(inputs), 1)) < 0.05 * (np.arange(inputs.shape[1]) == 0)",
        (f"{T_VERIFY}::test_bad_inputs_hold_what_is_not_finite_and_what_is_out_of_range",),
    ),
    Mutant(
        "proof: altered steps are no failure of the fuzz", FUZZ,
        "not (self.altered or self.unflagged", "not (self.unflagged",
        (f"{T_FUZZ}::test_what_is_found_is_a_failure",),
    ),
)  # fmt: skip
