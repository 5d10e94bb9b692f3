"""Docstrings become markup and formulas with the same content."""

import inspect
import math
import re
from collections.abc import Mapping
from typing import Any

import numpy as np
import pytest

from docs.machine.docstrings import escaped, first_line, latex, to_rst
from docs.machine.items import MADE_OF_LAWS
from symfric import ALL_LAWS, Law, parameters, with_values
from symfric.laws.composed.isotropic import PlanarSlip, SpatialSlip

DOC = """Do a thing with |v| and x_ of `Law`.

    F = N v

It goes on here,
in one paragraph.

    run = simulate(model, t_end=1.0)

Limits: none.
Source: Anon, 1999.

shape    slope    class
tanh     1        C∞

Args:
    a: first,
        longer |x|.
    b, c: others.

Returns:
    one: the first
        value.
    two: another.

Example:
    $ symfric laws
"""


def test_sections_stay_and_blocks_are_literal() -> None:
    shown = to_rst(DOC)
    for part in (
        r"Do a thing with \|v\| and x\_ of `Law`.",
        "::\n\n   F = N v\n",
        "It goes on here, in one paragraph.",
        "**Limits.** none.\n\n**Source.** Anon, 1999.",
        "::\n\n   shape    slope    class\n   tanh     1        C∞\n",
        "Args:\n    a: first,\n        longer \\|x\\|.\n    b, c: others.",
        "Returns:\n    * one: the first value.\n    * two: another.",
        "**Example**\n\n::\n\n   $ symfric laws\n",
    ):
        assert part in shown, part
    assert ".. math::" not in shown


def test_equations_and_symbols_become_formulas() -> None:
    shown = to_rst(
        "Title of mu_s.\n\n    F = N v\n\nAnd:\n\n    run = simulate(model!)\n", formulas=True
    )
    assert shown.count(".. math::") == 1
    assert r"\ :math:`\mu_{\mathrm{s}}`\ " in shown
    assert "::\n\n   run = simulate(model!)" in shown


@pytest.mark.parametrize(
    ("text", "markup"),
    [
        ("`a`s and (`b`)", r"`a`\ s and (`b`)"), ("A. Janot: x_1", r"A\. Janot: x_1"),
        ("2.5 m", "2.5 m"), ("a * b, **c", r"a * b, \*\*c"), ("[1]_", r"[1]\_"),
    ],
)  # fmt: skip
def test_markup_is_escaped(text: str, markup: str) -> None:
    assert escaped(text) == markup
    assert first_line("One\ntwo.\n\nThree.") == "One two."


LAWS = [
    kind.__mro__[1] if kind in (PlanarSlip, SpatialSlip) else kind
    for kind in (*ALL_LAWS.values(), *MADE_OF_LAWS.values())
]
LATEX_NAMES = {"varepsilon": "eps", "arctan": "atan", "arcsin": "asin", "infty": "inf"}
LAYOUT = """left right text mathrm operatorname quad begin end aligned prime dot le ge to pm
cdot ldots"""


def equations(kind: type) -> list[str]:
    """The indented blocks above the sections of a docstring."""
    doc = re.split(r"\n(?:Raises|Attributes|Args):", inspect.getdoc(kind) or "")[0]
    return re.findall(r"(?:^ {4}.*\n?)+", doc, re.M)


def words_of_text(block: str) -> list[str]:
    """Names, words and numbers of a docstring in their order, subscripts apart."""
    block = re.sub(r"\bd([A-Za-z]\w*)/dt\b", r"\1", block)
    words = re.findall(r"[A-Za-z]+|\d+(?:\.\d+)?", re.sub(r"_", " ", block))
    return ["eps" if word == "epsilon" else word for word in words]


def words_of_latex(text: str) -> list[str]:
    """The same of a formula."""
    text = text.replace(r"\operatorname{arsinh}", "asinh")
    text = re.sub(r"\\(begin|end)\{aligned\}", "", text)
    text = re.sub(rf"\\({'|'.join(LAYOUT.split())})(?![A-Za-z])", " ", text)
    words: list[str] = re.findall(r"[A-Za-z]+|\d+(?:\.\d+)?", text)
    return [LATEX_NAMES.get(word, word) for word in words]


def test_formulas_of_all_laws_have_the_symbols_of_the_text_in_their_order() -> None:
    for kind in LAWS:
        blocks = equations(kind)
        assert to_rst(inspect.getdoc(kind) or "", True).count(".. math::") == len(blocks) >= 1, kind
        for block in blocks:
            assert words_of_latex(latex(block)) == words_of_text(block), kind.__name__


@pytest.mark.parametrize(
    ("text", "formula"),
    [
        ("F = z^(-(d - 1)/2)", r"F &= z^{-\left(d - 1\right)/2}"),
        ("dF_1/dt = -v", r"\dot{F}_{1} &= - v"),
        ("F = sqrt(2e) v_eps", r"F &= \sqrt{2\,\mathrm{e}}\,v_{\varepsilon}"),
        ("F = N    for |v| <= v_r", r"F &= N &\quad\;\text{for}\;|v|\le v_{\mathrm{r}}"),
        ("F = a asinh(b)", r"F &= a\,\operatorname{arsinh}\left(b\right)"),
        ("on: dz/dt = v until r = 1", r"\text{on}\text{:}\quad\dot{z}&=v\;\text{until}\;r=1"),
        ("r = 0, between them a step of r", r"r&=0,\;\;\text{between them a step of}\;r"),
        ("F   = 1e-3 step(v)", r"F&=1\cdot 10^{-3}\,\operatorname{step}\left(v\right)"),
        ('x -> inf,   form = "slip"', r"x&\to\infty,\;\quad\mathrm{form}=\text{slip}"),
    ],
)  # fmt: skip
def test_lines_of_every_kind(text: str, formula: str) -> None:
    (line,) = latex(text).splitlines()[1:-1]
    assert re.sub(r"\s+", "", line) == re.sub(r"\s+", "", formula)


def test_continued_lines_are_one_row() -> None:
    assert latex("    F = a\n        + b").count(r"\\") == 0
    assert latex("    one: F = a\n         F = b").count(r"\\") == 1


@pytest.mark.parametrize("text", ["F = (a + b", "F = a]", "F = a /", "F = 'a'", "run = f(model!)"])
def test_other_texts_are_refused(text: str) -> None:
    with pytest.raises(ValueError, match="expected"):
        latex(text)


# ---- formulas compute the same as the laws: an oracle for both ----

N = 7.8
FUNCTIONS: Mapping[str, Any] = {
    **{name: getattr(math, name) for name in ("exp", "tanh", "sin", "sqrt", "pi", "e")},
    **{"arctan": math.atan, "arcsin": math.asin, "sign": np.sign, "abs": abs, "min": min},
    **{"max": max, "arsinh": math.asinh, "ln": math.log},
}


def python(text: str) -> str:
    """A formula as an expression of Python."""
    text = re.sub(r"\\(?:mathrm|text|operatorname)\{(\w+)\}", r"\1", text)
    text = text.replace(r"\varepsilon", "eps").replace(r"\infty", "inf")
    text = re.sub(r"_\{\\?(\w+)\}", r"_\1", text)
    text = re.sub(r"\\dot\{(\w)\}", r"rate_\1", text)
    text = re.sub(r"\\left(\(|\[|\\\{)", "(", re.sub(r"\\right(\)|\]|\\\})", ")", text))
    text = re.sub(r"\|([^|]*)\|", r"abs(\1)", text)
    text = text.replace(r"\,/\,", "/").replace("^{", "**(").replace(r"\sqrt{", "sqrt(")
    text = text.replace("}", ")").replace("{", "(").replace(r"\,", "*").replace(r"\;", " ")
    return re.sub(r"\\([a-z]+)", r"\1", text).strip()


def computed(block: str, known: dict[str, float]) -> dict[str, float]:
    """Every left-hand side of a block with its value, whatever the order of the equations."""
    rows = re.sub(r"\\(begin|end)\{aligned\}", "", latex(block)).replace("&", "").split("\\\\\n")
    parts = [part.strip().rstrip("\\;,") for row in rows for part in row.split(r"\quad")]
    sides = [python(part).split("=") for part in parts if "=" in part]
    found = dict(known)
    for _ in sides:
        for left, *_, right in sides:
            try:
                found[left.strip()] = eval(right.strip(" ,"), {**FUNCTIONS, **found})
            except NameError:
                continue
    return found


VELOCITIES = ("m/s", "rad/s", "s/m")
STATIC = (
    "stribeck", "tustin", "lorentzian", "brown_mcphee", "simscape_breakaway", "specker", "benson",
    "andersson", "duan_singh", "berger", "popp_stelter", "makkar_dixon", "self_tuning", "rui_wang",
    "capstan", "steady_state_lugre", "quarter_car_simple", "viscous", "hollars",
    "mixed_lubrication",
)  # fmt: skip


def sharp(name: str, **others: float) -> tuple[Law, dict[str, float], str]:
    """A law with narrow smoothing, its numbers, and its first block of equations."""
    law = ALL_LAWS[name](**others)
    narrow = {p.name: float(p.value) * 1e-4**p.width for p in parameters(law).values() if p.width}
    law = with_values(law, narrow)
    return law, {p.name: float(p.value) for p in parameters(law).values()}, equations(type(law))[0]


@pytest.mark.parametrize("name", STATIC)
def test_the_formula_of_a_memoryless_law_computes_its_force(name: str) -> None:
    law, numbers, block = sharp(name)
    wide = [(float(p.value), p.unit) for p in parameters(law).values() if p.width == 0 and p.value]
    scales = [1 / value if unit == "s/m" else value for value, unit in wide if unit in VELOCITIES]
    for v in max(scales, default=1.0) * np.array([-3.0, 0.4, 4.0]):
        found = computed(block, numbers | {"v": v, "N": N})["F"]
        assert found == pytest.approx(float(law.force(v, N)), rel=1e-4)


@pytest.mark.parametrize("name", ["lugre", "lugre_normalised", "lugre_passive", "dahl"])
def test_the_formula_of_a_bristle_computes_its_force_and_rate(name: str) -> None:
    law, numbers, block = sharp(name, **({"n": 1.5} if name == "dahl" else {"sigma_2": 0.3}))
    block = re.sub(r" {4,}\(n = 1: .*", "", block)
    v, z = 3e-3, np.array([4e-6])
    found = computed(block, numbers | {"v": v, "N": N, "z": float(z[0])})
    assert found["rate_z"] == pytest.approx(float(np.squeeze(law.rate(v, N, z))), rel=1e-5)
    assert found["F"] == pytest.approx(float(np.squeeze(law.force(v, N, z))), rel=1e-5)
