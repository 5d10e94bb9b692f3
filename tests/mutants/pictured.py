"""Defects of the figures of the papers."""

from mutants.mutant import Mutant

RANDOM = "symfric/figures/motion.py"
CAR = "symfric/scenes/rigs.py"

PICTURED = (
    Mutant(
        "a pushed population forgets a part of the force", RANDOM,
        "v += h / mass * (load[i] - held)", "v += h / mass * (load[i] - 0.9 * held)",
        ("tests/symfric/figures/test_push.py",),
    ),
    Mutant(
        "the road does not wait for its first ramp", CAR,
        "second = self.t_0 + self.t_first + self.t_hold",
        "second = self.t_0 + self.t_ramp + self.t_hold",
        ("tests/symfric/scenes/test_quarter_car.py",),
    ),
)  # fmt: skip
