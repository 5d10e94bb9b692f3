"""Presets: the numbers of a source for a scene, with each law's own at each place that rubs."""

from collections.abc import Mapping
from dataclasses import dataclass, field, fields, replace
from re import fullmatch
from typing import TypeVar, final

from symfric.foundation.parameters import parameters, with_values
from symfric.laws import Law

L = TypeVar("L", bound=Law)


@final
@dataclass(frozen=True, eq=False)
class Numbers:
    """Friction coefficients of one place from a source.

    Attributes:
        common: numbers that mean the same in every law, such as mu_s.
        laws: further ones of a kind of law, which names them as it likes.
    """

    common: Mapping[str, float]
    laws: Mapping[type[Law], Mapping[str, float]] = field(
        default_factory=dict[type[Law], dict[str, float]]
    )

    def given(self, law: L) -> L:
        """Return `law` with these numbers, also inside a sum or a wrapper; its other ones and forms
        stay.

        A law that the source does not use gets the common ones that it has. Elements that a law
        comes with and that carry a level together (mu_1, mu_2, ...) carry the new one in the shares
        that they had; elements given by the user are not changed.

        Raises:
            ValueError: numbers that contradict each other, such as given elements that do not carry
                the level.
        """
        held: dict[str, Law | tuple[Law, ...]] = {}
        for item in fields(law):
            value = getattr(law, item.name)
            if isinstance(value, Law):
                held[item.name] = self.given(value)
            elif item.name == "laws":  # the terms of a sum
                held[item.name] = tuple(self.given(term) for term in value)
        if held:
            return replace(law, **held)
        known = parameters(law)
        own = {name: value for name, value in self.common.items() if name in known}
        own |= self.laws.get(type(law), {})
        elements = [name for name in known if fullmatch(r"mu_\d+", name)]
        level = "mu_s" if "mu_s" in known else "mu_d"
        if elements and level in self.common:
            start = parameters(type(law)())
            shares = {name: float(start[name].value) for name in start if name in elements}
            if shares == {name: known[name].value for name in elements}:
                whole = float(start[level].value) if level in start else sum(shares.values())
                own |= {name: x * self.common[level] / whole for name, x in shares.items()}
        return with_values(law, own)


@final
@dataclass(frozen=True, eq=False)
class Preset:
    """Numbers of a source for a scene.

    Attributes:
        doc: what it is, and what the source leaves open.
        source: authors, title, table.
        values: parameters of the machine, and what its structure is.
        friction: place that rubs -> its numbers; "law" is where the scene's law is.
    """

    doc: str
    source: str
    values: Mapping[str, float]
    friction: Mapping[str, Numbers] = field(default_factory=dict[str, Numbers])
