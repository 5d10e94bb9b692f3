"""Mutants of functional mock-up units: their fixed C, their variables, their description."""

from mutants.mutant import Mutant

SOURCES = "symfric/fmu/sources"
ADAPTIVE, EXCHANGE = f"{SOURCES}/adaptive.c", f"{SOURCES}/exchange.c"
COMMUNICATION, RATES = f"{SOURCES}/communication.c", f"{SOURCES}/rates.c"
CONSISTENT, UNIT = f"{SOURCES}/consistent.c", f"{SOURCES}/unit.c"
T_STEPS = ("tests/symfric/fmu/test_cosimulation.py",)
T_GATES = ("tests/symfric/fmu/test_gates.py",)
T_RATES = ("tests/symfric/fmu/test_exchange.py",)
T_THIRD = "tests/symfric/fmu/test_third.py"
T_SOURCES = ("tests/symfric/fmu/test_sources.py",)
T_UNITS = ("tests/symfric/fmu/test_si_units.py",)

EXPORTED = (
    Mutant(
        "fmu: no step leads beyond the communication point", COMMUNICATION,
        "m->quiet = 1;", "m->quiet = 0;", T_STEPS,
    ),
    Mutant(
        "fmu: after a jump steps lead beyond the communication point", ADAPTIVE,
        "    m->quiet = 0;\n", "", T_STEPS,
    ),
    Mutant(
        "fmu: what lies beyond a jump is forgotten, nothing is made again", ADAPTIVE,
        "return steps_to(m, m->t);", "return 0;", T_STEPS,
    ),
    Mutant(
        "fmu: a step made again finds events that it has found", ADAPTIVE,
        "    memcpy(m->events, m->events_base, sizeof m->events);\n", "", T_GATES,
    ),
    Mutant(
        "fmu: an event beyond the communication point ends it there", ADAPTIVE,
        "m->stopped && m->S[AT_T] <= end ?", "m->stopped ?", T_GATES,
    ),
    Mutant(
        "fmu: steps lead beyond the stop time", ADAPTIVE,
        "if (m->limited && m->R[AT_END] > m->stop)", "if (0)", T_STEPS,
    ),
    Mutant(
        "fmu: between steps the polynomial is a line", ADAPTIVE,
        "s * (row[2 + N + i] + (1.0 - s) * bend)", "s * row[2 + N + i]", T_STEPS,
    ),
    Mutant(
        "fmu: events that have happened by the start are not seen", ADAPTIVE,
        "    if (any) m->events[PHASE] = JUMPED;\n", "", T_GATES,
    ),
    Mutant(
        "fmu: an input that jumps over an event is no event", COMMUNICATION,
        "    if (m->events[PHASE] == ON) m->events[PHASE] = JUMPED;\n", "", T_GATES,
    ),
    Mutant(
        "fmu: algebraic variables wait for the next step", COMMUNICATION,
        "return consistent(m->S + MEMORY, m->R + DATA, moved);", 'return moved < 0 ? "no" : "";',
        T_STEPS,
    ),
    Mutant(
        "fmu: a run that has ended goes on", COMMUNICATION,
        "if (m->phase == ENDED) return OVER;", "", T_GATES,
    ),
    Mutant(
        "fmu: a communication step from elsewhere is made", COMMUNICATION,
        "fabs(from - m->t) <= 1e-6 * size + 1e-12 * fabs(from) && ", "", T_STEPS,
    ),
    Mutant(
        "fmu: steps that fail are called refused", f"{SOURCES}/fmi2_cosimulation.c",
        "    default:\n        return failed(unit);", "    default:\n        return refused(unit);",
        T_STEPS,
    ),
    Mutant(
        "fmu: a terminal event of 3.0 does not say so", f"{SOURCES}/fmi3_cosimulation.c",
        "*terminate = found == OVER;", "*terminate = fmi3False;", T_GATES,
    ),
    Mutant(
        "fmu: the state of another model is put back", f"{SOURCES}/states.c",
        "    if (!of_this_model(state)) return 0;\n", "", T_GATES,
    ),
    Mutant(
        "fmu: a state is put back without its last step", f"{SOURCES}/states.c",
        "memcpy(&unit->m, state, sizeof(Memory));",
        "memcpy(&unit->m, state, offsetof(Memory, base));", T_STEPS,
    ),
    Mutant(
        "fmu: Newton's method is never damped", CONSISTENT,
        "part < 12; ++part, share *= 0.5", "part < 12; ++part, share *= 1.0", T_GATES,
    ),
    Mutant(
        "fmu: Newton's method gives up after a step", CONSISTENT,
        "for (k = 0; k < 50; ++k) {\n        double size = 0.0",
        "for (k = 0; k < 1; ++k) {\n        double size = 0.0", T_GATES,
    ),
    Mutant(
        "fmu: friction that jams is a solution", CONSISTENT,
        "return !(look[2] >= 0.0);", "return look[2] != look[2];", T_GATES,
    ),
    Mutant(
        "fmu: a start value set late is forgotten", UNIT,
        "    if (early) m->settled = 0;\n", "", T_GATES,
    ),
    Mutant(
        "fmu: the tolerance of events is loosened by the importer", UNIT,
        "    if (rtol > LARGEST_RTOL) rtol = LARGEST_RTOL;\n", "", T_GATES,
    ),
    Mutant(
        "fmu: an indicator at zero leaves the event in doubt", RATES,
        "m->rates[NX + i] += before", "before", T_RATES,
    ),
    Mutant(
        "fmu: an event happens again where it left the state", RATES,
        "            if (which[i]) m->events[i] = (double)NAN;\n", "", T_RATES,
    ),
    Mutant(
        "fmu: algebraic variables stay where derivatives are taken", f"{SOURCES}/derivatives.c",
        "along[i] -= model_free", "along[i] -= 0 * model_free", T_RATES,
    ),
    Mutant(
        "fmu: equal steps are one too many where sizes are rounded", f"{SOURCES}/fixed.c",
        " * (1.0 - 1e-9)", "", (f"{T_THIRD}::test_steps_of_a_fixed_length_are_those_of_the_plant",),
    ),
    Mutant(
        "fmu: a pascal is a newton", "symfric/foundation/units.py",
        '"Pa": "kg/(m s^2)"', '"Pa": "kg m/s^2"', T_UNITS,
    ),
    Mutant(
        "fmu: zero degrees are zero kelvin", "symfric/fmu/package.py",
        "shift = 273.15 if", "shift = 0.0 if", T_SOURCES,
    ),
    Mutant(
        "fmu: an output depends on its own equation alone", "symfric/fmu/variables.py",
        "in_groups = group.astype(int) @", "in_groups = np.eye(len(group), dtype=int) @", T_SOURCES,
    ),
    Mutant(
        "fmu: fixed steps may be given a tolerance", "symfric/fmu/variables.py",
        '("tunable", "") if rtol else', '("tunable", "") if True else', T_SOURCES,
    ),
)  # fmt: skip
