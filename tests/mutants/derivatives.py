"""Mutants of derivatives through events."""

from mutants.mutant import Mutant

FOLDER = "symfric/integrator/derivatives"
TESTS = ("tests/symfric/integrator/derivatives/test_saltation.py",)

DERIVATIVES = (
    Mutant(
        "a step behind an event keeps its size", f"{FOLDER}/functions.py",
        "of_h = -X[n:] if linked", "of_h = 0 * X[n:] if linked", TESTS,
    ),
    Mutant(
        "events come earlier instead of later", f"{FOLDER}/together.py",
        "delay = -np.hstack", "delay = np.hstack", TESTS,
    ),
    Mutant(
        "a step that begins and ends with an event begins at a fixed time", f"{FOLDER}/together.py",
        "fall[1:] = -(1 - theta)[", "fall[1:] = 0 * (1 - theta)[", TESTS,
    ),
    Mutant(
        "such a step is as long as it was meant to be", f"{FOLDER}/sensitivity.py",
        "q[1:] -= theta[:, None] * p", "q[1:] -= p", TESTS,
    ),
    Mutant(
        "weights within a step that moves stay where they are", f"{FOLDER}/sensitivity.py",
        "falls = (1 - since / path.size[k])", "falls = (0 - since / path.size[k])", TESTS,
    ),
)  # fmt: skip
