"""The mutants of `make mutants` are of this tree: their old lines stand there, and their tests."""

import re
from pathlib import Path

from mutants.mutants import MUTANTS

ROOT = Path(__file__).parents[1]


def test_every_mutant_changes_one_place_and_names_tests_that_run() -> None:
    assert len(MUTANTS) >= 30
    assert len({m.name for m in MUTANTS}) == len(MUTANTS)
    for m in MUTANTS:
        assert (ROOT / m.file).read_text(encoding="utf-8").count(m.old) == 1, m.name
        assert m.new != m.old, m.name
        assert m.tests, m.name
        for test in m.tests:
            path, _, name = test.partition("::")
            text = (ROOT / path).read_text(encoding="utf-8")
            assert f"def {name}(" in text if name else "def test_" in text, m.name
            assert not (name and re.search(rf"mark\.slow\n(@.*\n)*def {name}\(", text)), m.name
