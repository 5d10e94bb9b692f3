"""Mutants of the choice of a law."""

from mutants.mutant import Mutant

FOLDER = "symfric/choice"
TESTS = ("tests/symfric/choice/test_select.py",)

CHOSEN = (
    Mutant(
        "the peak of a smooth law is lower than the static level", f"{FOLDER}/smoothing.py",
        "return peaked(law, self.mu_s, self.load)", "return law", TESTS,
    ),
    Mutant(
        "a law that is far off is ranked", f"{FOLDER}/measured.py",
        "if row.error <= task.accuracy:", "if row.error <= 1e6 * task.accuracy:", TESTS,
    ),
    Mutant(
        "nobody asks what a law shows", f"{FOLDER}/nature.py",
        "if NEEDS[word][0] not in shown]", "if NEEDS[word][0] in ()]", TESTS,
    ),
    Mutant(
        "forms with events are not tried", f"{FOLDER}/nature.py",
        "else (exact, law)", "else (law,)", TESTS,
    ),
    Mutant(
        "every fixed step holds", f"{FOLDER}/measured.py",
        "if not (off <= share).all():", "if (off > 1e9).all():", TESTS,
    ),
    Mutant(
        "J+S takes laws that show pre-sliding, too", "symfric/gallery/selection/tables.py",
        'needs == "JS",', '"JS" in needs,', ("tests/symfric/gallery/test_jing_mi.py",),
    ),
)  # fmt: skip
