"""Mutants of what makes laws smooth, and of joints that close loops."""

from mutants.mutant import Mutant

RECOMMENDED = "symfric/figures/recommended.py"
SCALED = "symfric/figures/regularisation.py"
MEASURED = "symfric/bench/regularisation.py"
CLOSING, EQUATIONS = "symfric/multibody/joints.py", "symfric/multibody/equations.py"
T_RECOMMENDED = ("tests/symfric/figures/test_recommended.py",)
T_SCALED = ("tests/symfric/figures/test_regularisation.py",)
T_MEASURED = ("tests/symfric/bench/test_regularisation.py",)
T_CLOSING = ("tests/symfric/multibody/test_closing.py", "tests/symfric/multibody/test_joints.py")

REGULARISATION = (
    Mutant(
        "the first width that keeps the error is taken, whatever is drier", RECOMMENDED,
        "while kept and errors[kept - 1] <= self.wanted:",
        "while kept and errors[kept - 1] <= 9 * self.wanted:", T_RECOMMENDED,
    ),
    Mutant(
        "the reference is taken for the limit itself", RECOMMENDED,
        "return gaps[-1] / (RATIO**slowest - 1.0) if slowest > SLOWEST else inf",
        "return 1e-3 * gaps[-1] if slowest > SLOWEST else inf", T_RECOMMENDED,
    ),
    Mutant(
        "a stiffness shrinks where widths do", SCALED,
        'return -1.0 if p.role == "stiffness"', 'return 1.0 if p.role == "stiffness"', T_SCALED,
    ),
    Mutant(
        "motions are compared at their ends only", SCALED,
        "off = np.abs(one - reference)\n",
        "off = np.abs(one - reference)[:, -1:]\n", T_SCALED,
    ),
    Mutant(
        "the dry law has the nominal level, not the peak", MEASURED,
        "ExactCoulomb(mu_s=peak(law),", "ExactCoulomb(mu_s=0.15,", T_MEASURED,
    ),
    Mutant(
        "a bead is pressed by each component of its wire", CLOSING,
        'return friction.normal_force(("ball",), F, T)',
        "return friction.normal_force(self.rubs, F, T)", T_CLOSING,
    ),
    Mutant(
        "a guide that closes a loop may turn", CLOSING,
        "return ca.vertcat(p[0], R[0, 2])", "return ca.vertcat(p[0], R[0, 0])", T_CLOSING,
    ),
    Mutant(
        "joints that close loops are pressed in the child's axes", EQUATIONS,
        "pressing = reactions | own", "pressing = reactions", T_CLOSING,
    ),
)  # fmt: skip
