"""Mutants of friction compensation: stages, terms, observers, the loop that they are tried in."""

from mutants.mutant import Mutant

STAGES = "symfric/compensation/force.py"
TERMS = "symfric/compensation/force.py"
OBSERVERS = "symfric/compensation/observers.py"
LOOP, CASCADE = "symfric/compensation/loop.py", "symfric/compensation/compensator.py"
BLOCK = "symfric/compensation/compensator.py"
T_MEMBERS = ("tests/symfric/compensation/test_loop_by_hand.py",)
T_CASCADE = ("tests/symfric/compensation/test_cascade.py",)


def block(test: str) -> tuple[str, ...]:
    """A test of compensators, without `test_`."""
    return (f"tests/symfric/compensation/test_compensator.py::test_{test}",)


def observer(test: str) -> tuple[str, ...]:
    """A test of observers."""
    return (f"tests/symfric/compensation/test_observers.py::test_{test}",)


COMPENSATED = (
    Mutant(
        "compensation: the blend goes from the measured velocity to the desired one", STAGES,
        "share * v + (1 - share) * wanted", "share * wanted + (1 - share) * v",
        block("the_desired_velocity_moves_the_law_near_zero_and_the_measured_one_beyond"),
    ),
    Mutant(
        "compensation: the dead zone jumps", STAGES,
        "v - smooth.clip(v, -width, width)", "ca.if_else(ca.fabs(v) > width, v, 0)",
        block("a_dead_zone_is_silent_and_continuous"),
    ),
    Mutant(
        "compensation: friction builds up by the end of the step", STAGES,
        "mean = (b + end) / 2", "mean = end",
        block("friction_builds_up_over_a_way_and_remembers_short_reversals"),
    ),
    Mutant(
        "compensation: friction goes on to build up beyond its level", STAGES,
        "smooth.clip(b + 2 * v * h / way, -1.0, 1.0)", "b + 2 * v * h / way",
        block("friction_builds_up_over_a_way_and_remembers_short_reversals"),
    ),
    Mutant(
        "compensation: the further force stays when the axis moves", STAGES,
        "rests = smooth.clip(2 - ca.fabs(v) / slow, 0.0, 1.0)", "rests = ca.SX(1)",
        block("a_stuck_axis_is_freed_and_let_go"),
    ),
    Mutant(
        "compensation: the dither forgets its phase", STAGES,
        "end = smooth.fraction(phase + pace * h)", "end = smooth.fraction(pace * h)",
        block("dither_is_a_sine_of_its_own"),
    ),
    Mutant(
        "compensation: it fades in along a line", STAGES,
        "return F * smooth.step3(end)",
        "return F * end",
        block("it_fades_in_and_out_without_a_bump"),
    ),
    Mutant(
        "compensation: it is enabled by one half", STAGES,
        "ca.if_else(on > 0.5, h, -h)", "ca.if_else(on >= 0.5, h, -h)",
        block("it_fades_in_and_out_without_a_bump"),
    ),
    Mutant(
        "compensation: the force falls as fast as it likes", STAGES,
        "last + smooth.clip(F - last, -rate * h, rate * h)",
        "last + ca.fmin(F - last, rate * h)",
        block("force_and_its_pace_are_limited"),
    ),
    Mutant(
        "compensation: a negative force has no limit", STAGES,
        "smooth.clip(F, -most, most)", "ca.fmin(F, most)",
        block("force_and_its_pace_are_limited"),
    ),
    Mutant(
        "compensation: the scale of the Stribeck term scales the whole level", TERMS,
        "values.append(coulomb * base + stribeck * rise)",
        "values.append(stribeck * (base + rise))",
        block("scaled_terms_add_up_to_the_closed_form"),
    ),
    Mutant(
        "compensation: without bristles the load is divided by", TERMS,
        "N = ca.fmax(self.N, LEAST)", "N = self.N",
        block("without_a_load_there_is_no_force_and_it_comes_back"),
    ),
    Mutant(
        "compensation: sides that differ build up alike", TERMS,
        "one if _same(one, other) else", "one if True else",
        block("sides_that_differ_build_up_to_their_own_levels"),
    ),
    Mutant(
        "compensation: the stuck axis is told by the measured velocity alone", BLOCK,
        "freed(parts, wanted, v, h, *s.stick)", "freed(parts, v, v, h, *s.stick)",
        block("a_stuck_axis_is_freed_and_let_go"),
    ),
    Mutant(
        "compensation: the integrator is held while the axis moves", BLOCK,
        "ca.logic_and(ca.logic_and(*small[:2]), small[2])", "ca.logic_and(*small[:2])",
        block("the_integrator_is_held_at_rest_near_the_goal"),
    ),
    Mutant(
        "compensation: an offset has one sign", BLOCK,
        '"constant force", lower=-inf)', '"constant force")',
        block("offset_and_inertia_are_added"),
    ),
    Mutant(
        "observer: springs are stretched twice in the mean", OBSERVERS,
        "mean[i] + more / 2", "mean[i] + more",
        observer("an_error_that_stands_stretches_the_springs"),
    ),
    Mutant(
        "observer: the error bends the bristles the other way", OBSERVERS,
        "rate(v, load, z)) + push", "rate(v, load, z)) - push",
        observer("an_error_that_stands_bends_the_bristles"),
    ),
    Mutant(
        "observer: bristles are bent without end", OBSERVERS,
        "smooth.clip(step.end, -most, most)", "ca.SX(step.end)",
        observer("bristles_stay_in_the_set_that_the_law_never_leaves"),
    ),
    Mutant(
        "observer: the mean of the bristles knows no end", OBSERVERS,
        "smooth.clip(step.mean, -most, most)", "ca.SX(step.mean)",
        observer("bristles_stay_in_the_set_that_the_law_never_leaves"),
    ),
    Mutant(
        "observer: a filter of higher order takes the force of the one before it unfiltered",
        OBSERVERS, "        parts.next.append(force)\n    force = _finished",
        "        parts.next.append(d)\n    force = _finished",
        observer("a_disturbance_is_found_by_the_balance_of_impulse"),
    ),
    Mutant(
        "loop: forces act a sample earlier", LOOP,
        "for _ in range(setup.delay)]", "for _ in range(setup.delay - 1)]", T_MEMBERS,
    ),
    Mutant(
        "loop: an observer of forces sees its own", LOOP,
        "place -= acted.sum(axis=0) - acted[i]", "place -= acted.sum(axis=0)", T_MEMBERS,
    ),
    Mutant(
        "loop: blocks push beyond the limit of the drive", LOOP,
        'return np.clip(control.outputs["u"] + forces.sum(axis=0), -most, most)',
        'return np.clip(control.outputs["u"], -most, most) + forces.sum(axis=0)', T_MEMBERS,
    ),
    Mutant(
        "loop: nothing holds the integrator", LOOP,
        'if "hold" in block.outputs:', "if False:", T_MEMBERS,
    ),
    Mutant(
        "loop: the encoder cuts counts off", CASCADE,
        "ca.floor(x.symbol / self.count + 0.5)", "ca.floor(x.symbol / self.count)", T_CASCADE,
    ),
    Mutant(
        "loop: the integrator winds up", CASCADE,
        "free = ca.logic_or(wanted == u, (v_s - v_m) * u < 0)", "free = ca.SX(1)", T_CASCADE,
    ),
    Mutant(
        "loop: the error of the start counts", "symfric/compensation/result.py",
        "self.error[self.force.size // 10 :]", "self.error", T_MEMBERS,
    ),
)  # fmt: skip
