"""Presets: published parameters of scenes and of the laws in their contacts, from presets.toml."""

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
    """Published friction parameters of one contact.

    Attributes:
        common: parameters with the same meaning in all laws, such as mu_s.
        laws: further parameters of individual laws, by class of the law.
    """

    common: Mapping[str, float]
    laws: Mapping[type[Law], Mapping[str, float]] = field(
        default_factory=dict[type[Law], dict[str, float]]
    )

    def given(self, law: L) -> L:
        """Return `law` with these parameters, including laws inside a sum or a wrapper.

        Other parameters and the form do not change. A law that the source does not use gets those
        of the common parameters that it has. Default elements that carry a level together (mu_1,
        mu_2, ...) are scaled to the new level; elements given by the user are not changed.

        Raises:
            ValueError: parameters contradict each other, for example if elements given by the user
                do not carry the level.
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
    """Published parameters of a scene.

    Attributes:
        doc: description, including parameters that the source does not give.
        source: authors, title, table.
        values: parameters and structure of the machine.
        friction: friction parameters by contact; "law" is the contact of the law of the scene.
    """

    doc: str
    source: str
    values: Mapping[str, float]
    friction: Mapping[str, Numbers] = field(default_factory=dict[str, Numbers])


def presets_of(kind: type) -> Mapping[str, Preset]:
    """Return the presets of a class of scenes, or of its nearest base class that has presets."""
    every = _published()
    return next((every[c.__name__] for c in kind.__mro__ if c.__name__ in every), {})


@cache
def _published() -> dict[str, dict[str, Preset]]:
    """Return all presets by name of the class and name of the preset."""
    read = tomllib.loads(Path(__file__).with_name("presets.toml").read_text("utf-8"))
    numbers = {
        name: Numbers(table.pop("common"), {laws.ALL_LAWS[law]: x for law, x in table.items()})
        for name, table in read.pop("numbers").items()
    }
    for preset in (preset for scene in read.values() for preset in scene.values()):
        preset["friction"] = {place: numbers[n] for place, n in preset["friction"].items()}
    return {scene: {n: Preset(**p) for n, p in named.items()} for scene, named in read.items()}
