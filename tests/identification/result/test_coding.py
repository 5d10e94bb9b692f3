"""Frozen dataclasses through JSON and back."""

import json
from dataclasses import dataclass, field
from math import inf, isnan, nan
from typing import Any, final

import numpy as np
import pytest
from numpy.typing import NDArray

from identification.result.stored import plain, revived
from symfric.foundation.status import Status


@final
@dataclass(frozen=True)
class Inner:
    """A leaf."""

    name: str
    x: float = nan
    limit: float | None = None


@final
@dataclass(frozen=True, eq=False)
class Outer:
    """Everything that results hold."""

    status: Status
    inner: tuple[Inner, ...]
    by_pair: dict[tuple[str, str], Inner]
    y: NDArray[np.float64]
    matrix: NDArray[np.float64]
    flags: tuple[bool, int, str] = (True, 1, "a")
    none: Inner | None = None
    free: dict[str, Any] = field(default_factory=dict[str, Any])


def test_everything_comes_back() -> None:
    one = Outer(
        Status.SOLVED,
        (Inner("a", 1.5, inf), Inner("b")),
        {("run 1", "force"): Inner("c", -inf, 0.1)},
        np.array([1.0, nan, -inf]),
        np.array([[1.0, 0.5], [nan, 1.0]]),
        free={"n": 3, "text": "<b>"},
    )
    text = json.dumps(plain(one), allow_nan=False)
    back: Outer = revived(Outer, json.loads(text))
    assert back.status is Status.SOLVED
    assert (back.inner[0].x, back.inner[0].limit) == (1.5, inf)
    assert isnan(back.inner[1].x)
    assert back.inner[1].limit is None
    assert back.by_pair["run 1", "force"].x == -inf
    np.testing.assert_array_equal(back.y, one.y)
    np.testing.assert_array_equal(back.matrix, one.matrix)
    assert back.flags == (True, 1, "a")
    assert back.none is None
    assert back.free == {"n": 3, "text": "<b>"}
    assert json.dumps(plain(back)) == text


def test_numbers_keep_all_digits_and_arrays_six() -> None:
    assert plain(0.1 + 0.2) == 0.1 + 0.2
    assert plain(np.array([1 / 3])) == [0.333333]


def test_what_is_no_data_is_refused() -> None:
    with pytest.raises(TypeError, match="object"):
        plain(object())
