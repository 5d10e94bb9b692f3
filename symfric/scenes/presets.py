"""Presets: numbers of papers for scenes and for the laws in their contacts, from presets.toml."""

import tomllib
from collections.abc import Mapping
from dataclasses import dataclass, field, fields, replace
from functools import cache
from pathlib import Path
from re import fullmatch
from typing import TypeVar, final

from symfric import laws
from symfric.foundation.parameters import parameters, with_values
from symfric.laws import Law

L = TypeVar("L", bound=Law)


@final
@dataclass(frozen=True, eq=False)
class Numbers:
    """Friction coefficients of one contact from a source.

    Attributes:
        common: numbers with the same meaning in every law, such as mu_s.
        laws: further numbers of single laws, by the names of their parameters.
    """

    common: Mapping[str, float]
    laws: Mapping[type[Law], Mapping[str, float]] = field(
        default_factory=dict[type[Law], dict[str, float]]
    )

    def given(self, law: L) -> L:
        """Return `law` with these numbers, also inside a sum or a wrapper.

        Other parameters and the form stay. A law that the source does not use gets the common
        numbers that it has. Default elements that carry a level together (mu_1, mu_2, ...) carry
        the new one in the same shares; elements given by the user are not changed.

        Raises:
            ValueError: numbers that contradict each other, such as given elements that do not carry
                the level.
        """
        inner: dict[str, Law | tuple[Law, ...]] = {}
        for item in fields(law):
            value = getattr(law, item.name)
            if isinstance(value, Law):
                inner[item.name] = self.given(value)
            elif item.name == "laws":  # the terms of a sum
                inner[item.name] = tuple(self.given(term) for term in value)
        if inner:
            return replace(law, **inner)
        known = parameters(law)
        values = {name: value for name, value in self.common.items() if name in known}
        values |= self.laws.get(type(law), {})
        elements = [name for name in known if fullmatch(r"mu_\d+", name)]
        level = "mu_s" if "mu_s" in known else "mu_d"
        if elements and level in self.common:
            start = parameters(type(law)())
            shares = {name: float(start[name].value) for name in start if name in elements}
            if shares == {name: known[name].value for name in elements}:
                whole = float(start[level].value) if level in start else sum(shares.values())
                values |= {name: x * self.common[level] / whole for name, x in shares.items()}
        return with_values(law, values)


@final
@dataclass(frozen=True, eq=False)
class Preset:
    """Numbers of a source for a scene.

    Attributes:
        doc: description, and what the source does not give.
        source: authors, title, table.
        values: parameters and structure of the machine.
        friction: contact -> its numbers; "law" is the contact of the scene's law.
    """

    doc: str
    source: str
    values: Mapping[str, float]
    friction: Mapping[str, Numbers] = field(default_factory=dict[str, Numbers])


def presets_of(kind: type) -> Mapping[str, Preset]:
    """Return the presets of a class of scenes, or of the nearest base that has any."""
    every = _published()
    return next((every[c.__name__] for c in kind.__mro__ if c.__name__ in every), {})


@cache
def _published() -> dict[str, dict[str, Preset]]:
    """Return scene -> name -> preset."""
    read = tomllib.loads(Path(__file__).with_name("presets.toml").read_text("utf-8"))
    numbers = {
        name: Numbers(table.pop("common"), {laws.ALL_LAWS[law]: x for law, x in table.items()})
        for name, table in read.pop("numbers").items()
    }
    for preset in (preset for scene in read.values() for preset in scene.values()):
        preset["friction"] = {place: numbers[n] for place, n in preset["friction"].items()}
    return {scene: {n: Preset(**p) for n, p in named.items()} for scene, named in read.items()}
