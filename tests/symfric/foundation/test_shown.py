"""What objects say of themselves: within a screen, and as HTML that no name can break."""

from dataclasses import dataclass, fields
from typing import Any

import casadi as ca
import numpy as np
from pages import on_a_screen, parsed, shown

from symfric.foundation.parameters import Variable
from symfric.foundation.shown import (
    WIDTH,
    Shown,
    Table,
    among,
    brief,
    counted,
    cut,
    in_a_line,
    valued,
)
from symfric.integrator import Hold, Linear, simulate
from symfric.laws import ALL_LAWS, BrownMcPhee, LuGre
from symfric.model import Contact, Event, Monitor, Output
from symfric.scenes import ALL_SCENES, FourBar, QuarterCar

EVIL = '<script>alert("&")</script>'


def test_everything_of_a_user_is_escaped() -> None:
    page = parsed(Shown(EVIL, (EVIL,), Table((EVIL, ""), ((EVIL, "1"),)), (EVIL,)).html())
    assert page.words.count(EVIL) == 5


def test_a_long_table_names_what_it_leaves_out() -> None:
    rows = tuple((f"row{k}", f"{k}") for k in range(40))
    text = Shown("many", ("one",), Table(("name", "n"), rows, numbers=(1,)), ("last",)).text()
    assert on_a_screen(text)
    assert text.splitlines()[-1] == "last"
    assert "... 20 more: row20, row21" in text
    assert text.splitlines()[2:4] == ["  name    n", "  row0    0"]
    assert parsed(Shown("many", (), Table(("name", "n"), rows)).html()).words.count("row") == 40


def test_words_for_counts_and_values() -> None:
    assert [counted(n, "body", "bodies") for n in (0, 1, 2)] == ["no bodies", "1 body", "2 bodies"]
    assert among("abcd", 2) == "a, b, ... 2 more"
    assert valued([("m", 0.8, "kg"), ("mu", 0.2, "1")]) == "m = 0.8 kg, mu = 0.2"
    assert len(cut("x" * 300)) == WIDTH


def test_laws_show_parameters_and_a_picture() -> None:
    for name, law in ALL_LAWS.items():
        (line,) = law().thumbnail().axes[0].lines
        assert np.isfinite(line.get_ydata()).all(), name
    page = shown(LuGre())
    assert len(page.pictures) == 1
    assert "static friction coefficient" in page.words


def test_scenes_are_the_call_that_makes_them_and_models_show_no_expressions() -> None:
    laws = vars(__import__("symfric.laws").laws)
    for kind in ALL_SCENES.values():
        scene = kind(LuGre())
        text, model = repr(scene), scene.model()
        assert repr(eval(text, {**laws, kind.__name__: kind, "LuGre": LuGre})) == text
        reported = repr(model)
        assert on_a_screen(text) and on_a_screen(reported)
        assert "by LuGre" in reported and "SX(" not in reported and "@1" not in reported
        assert "further" not in model.__dict__, "showing must not write the details"
    assert "QuarterCar(law=LuGre(" in repr(QuarterCar(LuGre()))
    assert shown(QuarterCar(LuGre())).pictures


def test_parts_of_a_model_in_a_line() -> None:
    v = Variable("v", "m/s", doc="rate")
    for thing, words in (
        (v, "<variable 'v' [m/s], start 0: rate>"), (Output(1.0, "N"), "<output [N]>"),
        (Monitor(1.0, 1e-3), "<monitor on the scale 0.001>"),
        (Event("hit", 1.0, -1, terminal=True), "<event 'hit', falling, ends the run>"),
        (Contact("b", v.symbol, 1.0, LuGre(), bare=True), "<contact 'b' by LuGre, states z>"),
    ):  # fmt: skip
        assert repr(thing) == words


@dataclass(frozen=True, eq=False)
class Many:
    """Of all kinds."""

    array: Any
    mapping: Any

    __repr__ = brief


def test_arrays_are_described_by_size_and_range() -> None:
    lines = repr(Many(np.linspace(0, 5, 2001), {"a": np.zeros((3, 4)), "b": 1.0})).splitlines()
    assert lines[:2] == ["<Many", "  array: 2001 values from 0 to 5"]
    assert lines[2] == "  mapping: a: 3 x 4 values from 0 to 0, b: 1>"
    assert in_a_line(np.array([1.0, 2.5])) == "[1, 2.5]"
    assert in_a_line(np.full(20, np.nan)) == "20 values"
    assert in_a_line(ca.SX.sym("x", 3)) == "expression of shape (3, 1)"
    assert in_a_line(({}, (1, "a"), None)) == "(none, (1, 'a'), None)"


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
