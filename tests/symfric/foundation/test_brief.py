"""Data with arrays say sizes and ranges, not their numbers."""

from dataclasses import dataclass, fields
from typing import Any

import casadi as ca
import numpy as np
from pages import on_a_screen, shown

from symfric.foundation.shown import brief, told
from symfric.integrator import Hold, Linear, simulate
from symfric.laws import BrownMcPhee
from symfric.scenes import FourBar


@dataclass(frozen=True, eq=False)
class Many:
    """Of all kinds."""

    array: Any
    mapping: Any

    __repr__ = brief


def test_arrays_are_told_by_size_and_range() -> None:
    lines = repr(Many(np.linspace(0, 5, 2001), {"a": np.zeros((3, 4)), "b": 1.0})).splitlines()
    assert lines[:2] == ["<Many", "  array: 2001 values from 0 to 5"]
    assert lines[2] == "  mapping: a: 3 x 4 values from 0 to 0, b: 1>"
    assert told(np.array([1.0, 2.5])) == "[1, 2.5]"
    assert told(np.full(20, np.nan)) == "20 values"
    assert told(ca.SX.sym("x", 3)) == "expression of shape (3, 1)"
    assert told(({}, (1, "a"), None)) == "(none, (1, 'a'), None)"


def test_a_screen_is_enough_for_anything() -> None:
    long = {f"name_{k}": np.zeros(k) for k in range(300)}
    assert on_a_screen(repr(Many(long, tuple(range(1000)))))
    assert on_a_screen(repr(Linear(np.arange(1e4), np.arange(1e4))))
    assert repr(Hold([0, 1], [2, 3])) == "<Hold\n  t: [0, 1]\n  values: [2, 3]>"
    assert len(fields(Hold)) == 2


def test_an_energy_balance_is_a_table() -> None:
    books = simulate(FourBar(BrownMcPhee()).model(), 0.1, samples=11).energy_balance()
    text = repr(books)
    assert on_a_screen(text)
    row = next(line.split() for line in text.splitlines() if "work of friction" in line)
    assert row == ["work", "of", "friction", f"{books.work['friction'][-1]:.6g}"]
    assert f"unexplained over what moved: {books.relative:.2g}" in text
    assert "work of friction" in shown(books).words
