"""Doubts are problems for a strict reader only."""

from symfric.multibody.urdf_file import Notes


def test_a_strict_reader_takes_doubts_for_problems() -> None:
    for strict in (False, True):
        notes = Notes(strict)
        notes.doubt("a")
        assert (notes.problems, notes.doubts) == ((["a"], []) if strict else ([], ["a"]))
