"""Mutants of smooth laws and of dry friction, in mechanisms above all."""

from mutants.mutant import Mutant
from mutants.regularisation import REGULARISATION

APPLIED, SLIPS = "symfric/multibody/applied.py", "symfric/multibody/slips.py"
INITIAL = "symfric/integrator/equations/initial.py"
TESTS = ("tests/symfric/multibody/test_applied.py",)
SMOOTH = "symfric/laws/base/smooth.py"
PRINTED = ("tests/symfric/laws/static/test_printed.py", "tests/symfric/laws/base/test_smooth.py")

DRY = (
    *REGULARISATION,
    Mutant(
        "the fall of a static law is rounded over the width of its sign", SMOOTH,
        "CORNER = 1e-4", "CORNER = 1.0", PRINTED,
    ),
    Mutant(
        "the fall of a Stribeck curve is shifted by its rounding", SMOOTH,
        "    return exp(-_rounded_power(u, delta, eps / v_s))\n",
        "    return exp(-power(u, delta, eps / v_s))\n", PRINTED,
    ),
    Mutant(
        "the quadratic rise of Popp and Stelter does not see the load",
        "symfric/laws/static/smooth_peak.py",
        "            mu += self.kappa * v * v", "            mu += self.kappa * v * v / N", PRINTED,
    ),
    Mutant(
        "the band of Karnopp holds what it cannot", "symfric/laws/static/applied_force.py",
        "return (1 - w) * smooth.hold(F_e, static, self.F_eps) + w * slip",
        "return (1 - w) * F_e + w * slip", ("tests/symfric/laws/test_driving.py",),
    ),
    Mutant(
        "a law says that it is unverified, and not what that means", "symfric/laws/base/law.py",
        'said = f"{self.confidence} ({CONFIDENCE[self.confidence]})"', "said = self.confidence",
        ("tests/symfric/laws/test_contract.py",),
    ),
    Mutant(
        "a mode shows what error control adds to it", "symfric/model/kinds.py",
        "if kind != MODE:", "if kind:", ("tests/symfric/results/test_modes.py",),
    ),
    Mutant(
        "the mode of a loop is no mode", APPLIED,
        "doc=doc, kind=kinds.MODE", "doc=doc, kind=kinds.RATE",
        ("tests/symfric/results/test_modes.py",),
    ),
    Mutant(
        "rest keeps what rounding left of its velocity", APPLIED,
        "change = self.change + self.rate / CALM if self.by_modes else self.change",
        "change = self.change", TESTS,
    ),
    Mutant(
        "what holds contacts without a load shows in their shares", APPLIED,
        "UNLOADED = 1e-12", "UNLOADED = 1e-3", TESTS,
    ),
    Mutant(
        "contacts of a loop share its load by how far they move", APPLIED,
        "signs = [forward(g) if self.by_modes else g for g in self.along]",
        "signs = [g for g in self.along]", TESTS,
    ),
    Mutant(
        "a contact in its dead centre goes on as before", SLIPS,
        "turn = {name: -symbols[name] for name in names}",
        "turn = {name: symbols[name] for name in names}", TESTS,
    ),
    Mutant(
        "a loop that breaks away slides one way only", SLIPS,
        "onward = forward(T)", "onward = ca.SX(1.0)", TESTS,
    ),
    Mutant(
        "rest is sought by damped Newton alone", INITIAL,
        "if manifold is None or not manifold.applied:", "if True:", TESTS,
    ),
)  # fmt: skip
