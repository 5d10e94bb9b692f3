"""Mutants of what is kept and shown: packs, stored runs, states given to laws, accelerations."""

from mutants.mutant import Mutant

PACKED = "symfric/foundation/packed.py"
STORED = "symfric/integrator/stored.py"
INSTRUCTIONS = "symfric/foundation/instructions.py"
T_INSTRUCTIONS = ("tests/symfric/foundation/test_instructions.py",)
T_PACKED = ("tests/symfric/foundation/test_packed.py",)
T_STORED = ("tests/symfric/integrator/test_stored.py",)
T_SHOWN = ("tests/symfric/foundation/test_shown.py",)
DOUBTS = "symfric/integrator/running/doubts.py"
T_DOUBTS = ("tests/symfric/integrator/running/test_doubts.py",)
HOLDING = "symfric/model/forces.py"
T_HOLDING = ("tests/symfric/model/test_holding.py",)
T_ACCELERATIONS = ("tests/symfric/model/test_accelerations.py",)

HELD = (
    Mutant(
        "a file may name classes of anybody", PACKED,
        'if self._own is not None and place.split(".")[0] not in storable.OWN:', "if False:",
        T_PACKED,
    ),
    Mutant(
        "options of CasADi are read from a file", PACKED,
        "if not storable.fits(tuple(parts), FUNCTION):", "if False:", T_PACKED,
    ),
    Mutant(
        "CasADi's serialization is read from a file", PACKED,
        "            raise _foreign()\n        return identity",
        "            pass\n        return identity", T_PACKED,
    ),
    Mutant(
        "a file may name any class of ours", PACKED,
        "if self._own is not None and not storable.may_hold(path):", "if False:", T_PACKED,
    ),
    Mutant(
        "fields of a file may be of any type", "symfric/foundation/storable.py",
        "if not fits(value, hint):", "if False:", T_PACKED,
    ),
    Mutant(
        "operands may follow their operation", INSTRUCTIONS,
        "_within(self.code[:, 1:].T, count + np.arange(len(self.code)))",
        "_within(self.code[:, 1:], count + len(self.code))", T_INSTRUCTIONS,
    ),
    Mutant(
        "a file may give two symbols one name", INSTRUCTIONS,
        "symbols == len(self.names) == len(set(self.names))", "symbols == len(self.names)",
        T_INSTRUCTIONS,
    ),
    Mutant(
        "rows of compiled loops may be short", "symfric/integrator/compiled/columns.py",
        "if flat.shape[1] != size:", "if False:",
        ("tests/symfric/integrator/compiled/test_columns.py",),
    ),
    Mutant(
        "a file of another version is read", PACKED,
        'if not 1 <= about["format"] <= form:', "if False:", T_STORED,
    ),
    Mutant(
        "a symbol that is read is a new one", "symfric/foundation/identity.py",
        "    if pairs:", "    if False:", ("tests/symfric/foundation/test_identity.py",),
    ),
    Mutant(
        "a symbol has another name each time", "symfric/foundation/identity.py",
        "found or _known(symbol, uuid4().hex)", "_known(symbol, uuid4().hex)",
        ("tests/symfric/foundation/test_identity.py",),
    ),
    Mutant(
        "functions of symfric in a file are called", PACKED,
        "if self._own is not None and path not in self._own:", "if False:", T_PACKED,
    ),
    Mutant(
        "derivatives of a stored run forget its events", STORED,
        "self.guess, self.jumps, self.tolerance", "self.guess, (), self.tolerance", T_STORED,
    ),
    Mutant(
        "extremes of members are those at the times of the result", "symfric/results/ensemble.py",
        "        if name in self.reach:\n            least", "        if False:\n            least",
        ("tests/symfric/results/test_studies.py",),
    ),
    Mutant(
        "a stored fit forgets its noise", "identification/fit.py",
        "made = asked.task.with_noise(noise)\n        point = made.at(w)",
        "made = asked.task\n        point = made.at(w)",
        ("tests/identification/result/test_saved.py",),
    ),
    Mutant(
        "shared objects become several", PACKED,
        "if id(value) in self._known:", "if False:", T_PACKED,
    ),
    Mutant(
        "a stored run forgets its events", STORED,
        "happened=list(self.happened)", "happened=[]", T_STORED,
    ),
    Mutant(
        "a stored model has no further results", "symfric/model/model.py",
        'state["details"] = Given(dict(self.further))', 'state["details"] = Given({})', T_STORED,
    ),
    Mutant(
        "names of a user are no text in a page", "symfric/foundation/shown.py",
        'f"{escape(text)}</{mark}>"', 'f"{text}</{mark}>"', T_SHOWN,
    ),
    Mutant(
        "a law takes more states than it has", "symfric/laws/base/law.py",
        "if rows != len(law.states):", "if rows < len(law.states):",
        ("tests/symfric/laws/base/test_given.py",),
    ),
    Mutant(
        "an acceleration is the rate", "symfric/model/start.py",
        "Output(model.ode[r], unit", "Output(model.ode[k], unit", T_ACCELERATIONS,
    ),
    Mutant(
        "deflections follow the load", "symfric/laws/composed/wrap.py",
        "        return self.N_0\n", "        return N\n",
        ("tests/symfric/laws/composed/test_normalised.py",),
    ),
    Mutant(
        "friction that adds energy is not said", "symfric/integrator/running/doubts.py",
        "steady[worst] * slip[worst] < 0", "steady[worst] * slip[worst] > 0", T_DOUBTS,
    ),
    Mutant(
        "what a bristle carries beyond its level is not said", DOUBTS,
        "if held.fixed and most <= 1 + MARGIN:", "if held.fixed:", T_DOUBTS,
    ),
    Mutant(
        "a load that fell is taken for overload", DOUBTS,
        "np.where(growth > 0, ratio, 0.0)", "ratio", T_DOUBTS,
    ),
    Mutant(
        "what a user starts with is taken for overload", DOUBTS,
        "start = max(1.0, ratio[0])", "start = 1.0", T_DOUBTS,
    ),
    Mutant(
        "long runs are not looked at", DOUBTS,
        "elif most > allowed and not run.complete:", "elif False:", T_DOUBTS,
    ),
    Mutant(
        "behind a reversal Bliman and Sorine are taken to be overloaded",
        "symfric/laws/dynamic/dahl.py",
        "else self.mu_1 + self.mu_2)", "else self.mu_1)", T_DOUBTS,
    ),
    Mutant(
        "contacts that slide keep their velocity", HOLDING,
        "ca.if_else(ca.fabs(mode) < STICKS, _change(c, model), sliding)", "_change(c, model)",
        T_HOLDING,
    ),
    Mutant(
        "the applied force ignores time", HOLDING, " + ca.jacobian(slip, model.t)", "", T_HOLDING,
    ),
    Mutant(
        "a slip is reset in its first state", HOLDING,
        "key=lambda v: sum(ca.depends_on(s, v.symbol) for s in all_slips)",
        "key=lambda v: linear.index(v)", T_HOLDING,
    ),
    Mutant(
        "normal forces may depend on friction by any function", HOLDING,
        "if ca.depends_on(slopes, F):", "if False:", T_HOLDING,
    ),
    Mutant(
        "pulses within jumps of a function of time are leapt over",
        "symfric/integrator/equations/expressions.py", "return tuple(middle[high].tolist())",
        "return ()", ("tests/symfric/integrator/equations/test_onsets.py",),
    ),
    Mutant(
        "peaks of short pulses are not hit", "symfric/integrator/equations/expressions.py",
        "if height.max() > PULSE * height[-1]:", "if False:",
        ("tests/symfric/integrator/equations/test_onsets.py",),
    ),
)  # fmt: skip
