"""Equations of docstrings become formulas that hold the same symbols in the same order."""

import inspect
import re

import pytest

from docs.machine.formula import latex
from docs.machine.items import MADE_OF_LAWS
from docs.machine.rst import to_rst
from symfric import ALL_LAWS
from symfric.laws.composed.isotropic import PlanarSlip, SpatialSlip

LAWS = [*ALL_LAWS.values(), *MADE_OF_LAWS.values()]
LATEX_NAMES = {"varepsilon": "eps", "arctan": "atan", "arcsin": "asin", "infty": "inf"}
LAYOUT = """left right frac text mathrm operatorname quad begin end aligned prime dot le ge to pm
cdot ldots"""


def symbols_of_text(block: str) -> list[str]:
    """Names, words and numbers of a docstring in their order, subscripts apart."""
    block = re.sub(r"\bd([A-Za-z]\w*)/dt\b", r"\1", block)
    words = re.findall(r"[A-Za-z]+|\d+(?:\.\d+)?", re.sub(r"_", " ", block))
    return ["eps" if word == "epsilon" else word for word in words]


def symbols_of_latex(text: str) -> list[str]:
    """The same of a formula."""
    text = re.sub(r"\\operatorname\{arsinh\}", "asinh", text)
    text = re.sub(r"\\(begin|end)\{aligned\}", "", text)
    text = re.sub(rf"\\({'|'.join(LAYOUT.split())})(?![A-Za-z])", " ", text)
    words = re.findall(r"[A-Za-z]+|\d+(?:\.\d+)?", text)
    return [LATEX_NAMES.get(word, word) for word in words]


def equations(kind: type) -> list[str]:
    """The indented blocks above the sections of a docstring."""
    doc = re.split(r"\n(?:Raises|Attributes|Args):", inspect.getdoc(kind) or "")[0]
    return re.findall(r"(?:^ {4}.*\n?)+", doc, re.M)


def test_every_law_has_its_equation_as_a_formula() -> None:
    for kind in LAWS:
        if kind in (PlanarSlip, SpatialSlip):
            kind = kind.__mro__[1]
        shown = to_rst(inspect.getdoc(kind) or "")
        assert shown.count(".. math::") == len(equations(kind)) >= 1, kind.__name__


def test_formulas_hold_the_symbols_of_the_text_in_their_order() -> None:
    for kind in LAWS:
        for block in equations(kind):
            assert symbols_of_latex(latex(block)) == symbols_of_text(block), kind.__name__


@pytest.mark.parametrize(
    ("text", "formula"),
    [
        ("F = a b / c d", r"F &= \frac{a\,b}{c}\,d"),
        ("F = a b/c d", r"F &= a\,\frac{b}{c}\,d"),
        ("F = a + b c / (d + e)", r"F &= a + \frac{b\,c}{d + \mathrm{e}}"),
        ("F = (a + b)^2 / c", r"F &= \frac{{\left(a + b \right)}^{2}}{c}"),
        ("F = |a/b|^delta", r"F &= {\left|\frac{a}{b}\right|}^{\delta}"),
        ("F = z^((d - 1)/2)", r"F &= {z}^{\frac{d - 1}{2}}"),
        ("F = z^(1/n)", r"F &= {z}^{1/n}"),
        ("dF_1/dt = -v", r"\dot{F}_{1} &= - v"),
        ("F = sqrt(2e) v_eps", r"F &= \sqrt{2\,\mathrm{e}}\,v_{\varepsilon}"),
        ("F = N    for |v| <= v_r", r"F &= N &\quad\;\text{for}\;\left|v\right|\le v_{\mathrm{r}}"),
        ("on: dz/dt = v until r = 1", r"\text{on}\text{:}\quad\dot{z}&=v\;\text{until}\;r=1"),
        ("r = 0, between them a step of r", r"r&=0,\;\;\text{between them a step of}\;r"),
    ],
)  # fmt: skip
def test_lines_of_every_kind(text: str, formula: str) -> None:
    (line,) = latex(text).splitlines()[1:-1]
    assert re.sub(r"\s+", "", line) == re.sub(r"\s+", "", formula)


def test_lines_that_go_on_are_one_and_others_are_not() -> None:
    assert latex("    F = a\n        + b").count(r"\\") == 0
    assert latex("    one: F = a\n         F = b").count(r"\\") == 1


@pytest.mark.parametrize("text", ["F = (a + b", "F = a /", "F = 'a'", "run = simulate(model!)"])
def test_what_is_no_equation_is_refused(text: str) -> None:
    with pytest.raises((ValueError, KeyError, IndexError)):
        latex(text)
