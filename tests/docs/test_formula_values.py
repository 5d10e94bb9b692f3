"""Formulas made of docstrings compute what the laws compute: an oracle for both."""

import math
import re
from collections.abc import Callable
from inspect import getdoc

import numpy as np
import pytest

from docs.machine.formula import latex
from symfric import ALL_LAWS, Law, parameters, with_values

N = 7.8
FUNCTIONS: dict[str, Callable[..., float]] = {
    name: getattr(math, name) for name in ("exp", "tanh", "sin", "sqrt", "pi", "e")
}
FUNCTIONS |= {"arctan": math.atan, "arcsin": math.asin, "sign": np.sign, "abs": abs, "min": min}
FUNCTIONS |= {"max": max, "arsinh": math.asinh, "ln": math.log}


def group(text: str, start: int) -> int:
    """The place behind the brace that closes the one at `start`."""
    depth = 0
    for place in range(start, len(text)):
        depth += {"{": 1, "}": -1}.get(text[place], 0)
        if depth == 0:
            return place + 1
    raise ValueError(text)


def python(text: str) -> str:
    """A formula as an expression of Python."""
    text = re.sub(r"\\(?:mathrm|text|operatorname)\{(\w+)\}", r"\1", text)
    text = text.replace(r"\varepsilon", "eps").replace(r"\infty", "inf")
    text = re.sub(r"_\{\\?(\w+)\}", r"_\1", text)
    text = re.sub(r"\\dot\{(\w)\}", r"rate_\1", text)
    text = re.sub(r"\\left\|", "abs(", text).replace(r"\right|", ")")
    text = re.sub(r"\\left(?:\(|\[|\\\{)", "(", text)
    text = re.sub(r"\\right(?:\)|\]|\\\})", ")", text)
    while (place := text.find(r"\frac{")) >= 0:
        middle = group(text, place + 5)
        end = group(text, middle)
        above, below = text[place + 6 : middle - 1], text[middle + 1 : end - 1]
        text = f"{text[:place]}(({above})/({below})){text[end:]}"
    while "}^{" in text:
        middle = text.find("}^{") + 1
        start = next(k for k in range(middle) if text[k] == "{" and group(text, k) == middle)
        end = group(text, middle + 1)
        power = f"(({text[start + 1 : middle - 1]})**({text[middle + 2 : end - 1]}))"
        text = text[:start] + power + text[end:]
    text = re.sub(r"\\sqrt\{([^{}]*)\}", r"sqrt(\1)", text)
    return re.sub(r"\\([a-z]+)", r"\1", text.replace(r"\,", "*").replace(r"\;", " ")).strip()


def computed(block: str, known: dict[str, float]) -> dict[str, float]:
    """Every left-hand side of a block with its value, whatever the order of the equations."""
    rows = re.sub(r"\\(begin|end)\{aligned\}", "", latex(block)).replace("&", "").split("\\\\\n")
    parts = [part.strip().rstrip("\\;,") for row in rows for part in row.split(r"\quad")]
    sides = [python(part).split("=") for part in parts if "=" in part]
    waiting = [(side[0], side[-1]) for side in sides]
    found = dict(known)
    for _ in waiting:
        for left, right in waiting:
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
)  # fmt: skip


def sharp(name: str, **others: float) -> tuple[Law, dict[str, float], str]:
    """A law with narrow smoothing, its numbers, and its first block of equations."""
    law = ALL_LAWS[name](**others)
    narrow = {p.name: float(p.value) * 1e-4**p.width for p in parameters(law).values() if p.width}
    law = with_values(law, narrow)
    block = re.findall(r"(?:^ {4}.*\n?)+", getdoc(type(law)) or "", re.M)[0]
    return law, {p.name: float(p.value) for p in parameters(law).values()}, block


@pytest.mark.parametrize("name", STATIC)
def test_formula_of_a_memoryless_law(name: str) -> None:
    law, numbers, block = sharp(name)
    wide = [(float(p.value), p.unit) for p in parameters(law).values() if p.width == 0 and p.value]
    scales = [1 / value if unit == "s/m" else value for value, unit in wide if unit in VELOCITIES]
    scale = max(scales, default=1.0)
    for v in (-3.0, 0.4, 4.0):
        said = computed(block, numbers | {"v": v * scale, "N": N})["F"]
        assert said == pytest.approx(float(law.force(v * scale, N)), rel=1e-4)


@pytest.mark.parametrize("name", ["lugre", "lugre_normalised", "lugre_passive", "dahl"])
def test_formula_of_a_bristle(name: str) -> None:
    law, numbers, block = sharp(name, **({"n": 1.5} if name == "dahl" else {"sigma_2": 0.3}))
    block = re.sub(r" {4,}\(n = 1: .*", "", block)
    v, z = 3e-3, np.array([4e-6])
    found = computed(block, numbers | {"v": v, "N": N, "z": float(z[0])})
    assert found["rate_z"] == pytest.approx(float(np.squeeze(law.rate(v, N, z))), rel=1e-5)
    assert found["F"] == pytest.approx(float(np.squeeze(law.force(v, N, z))), rel=1e-5)
