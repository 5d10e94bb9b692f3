"""Tables of cases: samples, and TOML files whose texts are Python expressions of public names."""

import tomllib
from collections.abc import Iterable
from pathlib import Path
from typing import Any

import pytest

import symfric
from symfric import codegen, compensation, embedded, laws, scenes


def sampled(cases: Iterable[Any], of: int) -> list[Any]:
    """Parameters of a test: the first of every `of` cases, the others as slow tests."""
    return [
        pytest.param(*(case if isinstance(case, tuple) else (case,)), marks=marks)
        for number, case in enumerate(cases)
        for marks in [[pytest.mark.slow] * (number % of > 0)]
    ]


def table(test: str, name: str = "cases") -> dict[str, Any]:
    """The TOML file `name` in the folder of a test, given by its __file__."""
    return tomllib.loads(Path(test).with_name(f"{name}.toml").read_text(encoding="utf-8"))


class Names(dict[str, Any]):
    """Names of expressions: those given, and all public names of the packages."""

    def __missing__(self, name: str) -> object:
        packages = (laws, codegen, compensation, embedded, scenes, symfric)
        found = [getattr(package, name) for package in packages if hasattr(package, name)]
        if not found:
            raise KeyError(name)
        return found[0]

    def value(self, text: str) -> Any:
        """The value of an expression."""
        return eval(text, {}, self)
