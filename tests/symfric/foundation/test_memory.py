"""What is kept for the next call."""

from collections.abc import Hashable

from symfric.foundation.memory import remember


def test_the_first_stays_and_the_oldest_goes() -> None:
    known: dict[Hashable, str] = {}
    assert remember(known, 1, "a", 2) == "a"
    assert remember(known, 1, "b", 2) == "a"
    assert remember(known, 2, "c", 2) == "c"
    assert remember(known, 2, "d", 2) == "c"
    assert known == {1: "a", 2: "c"}
    assert remember(known, 3, "e", 2) == "e"
    assert known == {2: "c", 3: "e"}
