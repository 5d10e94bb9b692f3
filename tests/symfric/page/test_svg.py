"""Charts and pages as text: parsed as XML, with points where they belong and nothing unescaped."""

import xml.etree.ElementTree as ET
from re import findall

import numpy as np
import pytest
from pages import Balanced

from symfric.page import html
from symfric.page.svg import (
    BOTTOM,
    LEFT,
    RIGHT,
    TOP,
    Axis,
    Band,
    Dots,
    Frame,
    Level,
    Polyline,
    Stems,
    around,
    chart,
)

NASTY = "<script>alert('1')</script> & \"x\""


def test_points_are_at_their_numbers_and_a_missing_number_splits_a_line() -> None:
    x, y = Axis("t", "s", 0.0, 10.0), Axis("v", "m/s", -1.0, 1.0)
    drawn = chart(
        "v", x, y, [Polyline("line", np.array([0.0, 5.0, 10.0]), np.array([-1.0, 0.0, 1.0]))]
    )
    w, h = 920 - LEFT - RIGHT, 230 - TOP - BOTTOM
    assert findall(r'points="([^"]*)"', drawn) == [f"0,{h:g} {w / 2:g},{h / 2:g} {w:g},0"]
    line = Polyline("line", np.arange(7.0), np.array([0.0, 1.0, np.nan, 1.0, 0.0, np.nan, np.nan]))
    drawn = line.draw(Frame(Axis("x", "", 0.0, 6.0), Axis("y", "", 0.0, 1.0), 60.0, 10.0))
    assert findall(r'points="([^"]*)"', drawn) == ["0,10 10,0", "30,0 40,10"]
    stems = Stems("stem", np.arange(3.0), np.array([1.0, np.nan, 0.5]))
    assert 'd="M0 10V0M40 10V5"' in stems.draw(Frame(x, Axis("y", "", 0.0, 1.0), 200.0, 10.0))


def test_a_logarithmic_axis_has_its_decades() -> None:
    axis = around("cost", "", [np.array([1e-3, 1.0, 0.0, -2.0, np.nan])], logarithmic=True)
    assert 0 < axis.low < 1e-3 < 1.0 < axis.high
    assert [label for _, label in axis.ticks()] == ["10⁻³", "10⁻²", "10⁻¹", "10⁰"]
    middle = Axis("c", "", 1e-4, 1.0, logarithmic=True).at(np.array([1e-2]))
    np.testing.assert_allclose(middle, 0.5)


@pytest.mark.parametrize(
    ("low", "high"), [(-3e-7, 4e-7), (0.0, 1e6), (2.0, 2.0 + 1e-9), (-8.5e-4, 8.6e-4)]
)
def test_ticks_are_few_round_and_distinct(low: float, high: float) -> None:
    axis = around("x", "m", [np.array([low, high])])
    ticks = axis.ticks()
    labels = [label for _, label in ticks]
    assert 3 <= len(ticks) <= 8
    assert 3 <= len(axis.ticks(3)) <= 5
    assert len(set(labels)) == len(labels)
    assert max(map(len, labels)) <= 12
    assert all(axis.low <= value <= axis.high for value, _ in ticks)


def test_labels_have_whole_counts_and_powers_of_ten() -> None:
    assert [label for _, label in Axis("n", "", 0.5, 3.5, whole=True).ticks(9)] == ["1", "2", "3"]
    for axis, label in (
        (Axis("x", "m", -3e-7, 4e-7), "x [10⁻⁹ m]"), (Axis("F", "N", 0.0, 2e6), "F [10⁶ N]"),
        (Axis("F", "N", 0.0, 2e3), "F [N]"), (Axis("n", "1", 0.0, 2.0), "n"),
    ):  # fmt: skip
        assert axis.label == label
    for y in (np.full(3, np.nan), np.full(3, 7.0), np.zeros(0)):  # no numbers, or no range
        x = np.arange(float(y.size))
        drawn = chart("x", around("x", "", [x]), around("y", "", [y]), [Polyline("a", x, y)])
        ET.fromstring(drawn)
        assert "nan" not in drawn


def test_every_chart_is_xml_with_a_title_and_a_description() -> None:
    x, y = Axis(NASTY, "s", 0.0, 1.0), Axis("y", NASTY, 0.0, 1.0)
    ones = np.array([0.2, 0.8, 5e9])
    marks = [
        Polyline("a", ones, ones, NASTY), Dots("b", ones, ones, "dots"), Stems("c", ones, ones),
        Level("d", 0.5), Level("e", 7.0), Level("f", 0.2, upright=True), Band("g", -1.0, 2.0),
    ]  # fmt: skip
    root = ET.fromstring(chart(NASTY, x, y, marks, says=NASTY))
    texts = ["".join(e.itertext()) for e in root.iter()]
    assert [e.text for e in root.iter("title")] == [NASTY]
    assert [e.text for e in root.iter("desc")] == [NASTY]
    assert root.get("role") == "img"
    assert not list(root.iter("script"))
    assert f"{NASTY} [s]" in texts


def test_coincident_points_are_omitted() -> None:
    x = np.linspace(0, 1, 100_000)
    frame = Frame(Axis("x", "", 0, 1), Axis("y", "", -1, 1), 600, 200)
    line, dots = (kind("a", x, np.zeros(x.size)).draw(frame) for kind in (Polyline, Dots))
    assert len(line) < 80_000
    assert dots.count("M") <= 6001


def test_a_page_is_one_document_with_escaped_text() -> None:
    body = [
        html.title(NASTY), html.paragraph(NASTY), html.bullets([NASTY]), html.heading(NASTY),
        html.code(NASTY), html.verdict("bad", NASTY, [NASTY]), html.contents([("a", NASTY)]),
        html.table(NASTY, [NASTY, "b"], [[NASTY, NASTY]], (1,), ["note"]),
        html.triangle(NASTY, [NASTY, "b"], [[1.0, None], [-0.5, 1.0]]),
        html.section("a", NASTY, html.figure("<svg></svg>", NASTY)),
    ]  # fmt: skip
    page = html.page(NASTY, "en", "".join(body))
    assert "<script" not in page
    assert page.startswith("<!DOCTYPE html>")
    Balanced(page)
    assert page.count("&lt;script&gt;") == 17


def test_empty_parts_give_empty_texts() -> None:
    assert html.table("", ["a"], []) == ""
    assert html.section("a", "b", "", "") == ""
    assert html.bullets([]) == html.paragraph("") == html.triangle("", ["a"], [[1.0]]) == ""
