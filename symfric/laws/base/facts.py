"""Properties of laws that are not part of their equations: phenomena, smoothness, sources."""

from dataclasses import dataclass
from inspect import cleandoc
from re import DOTALL, search

PHENOMENA = {
    "D": "dynamic (kinetic) friction",
    "S": "static friction (stiction or a break-away peak)",
    "St": "Stribeck effect",
    "V": "viscous friction",
    "P": "pre-sliding displacement",
    "M": "non-local memory (hysteresis loops inside loops close)",
    "L": "frictional lag",
    "B": "break-away force depends on the loading rate",
    "N": "no drift under vibration below break-away",
    "T": "static friction grows with the dwell time",
}
"""Phenomena that a law can reproduce, by the codes in `Facts.phenomena`."""

CONFIDENCE = {
    "two sources": "the formula was compared with two independent ones",
    "one source": "the formula was compared with one",
    "textbook": "the formula is in every textbook",
    "rebuilt": "the formula was lost or garbled, and rebuilt from descriptions of it",
    "constructed": "constructed here",
    "unverified": "written from memory, compared with no publication and no public code",
}
"""Confidence in a formula, by the words in `Facts.confidence`."""


@dataclass(frozen=True)
class Facts:
    """Properties of a law that are not part of its equations.

    Attributes:
        phenomena: codes of `PHENOMENA`.
        smoothness: differentiability class in the velocity, and the exceptions.
        confidence: a key of `CONFIDENCE`.
        source: publication of the law; by default the section "Source:" of its docstring.
        odd: True if the force changes sign when v, the states and the further inputs do.
        load: dependence of the dry force on N: "proportional", "independent" or a description.
        checked: reference of the comparison; by default the section "Checked:" of the docstring.
    """

    phenomena: tuple[str, ...]
    smoothness: str
    confidence: str
    source: str = ""
    odd: bool = True
    load: str = "proportional"
    checked: str = ""

    def __set_name__(self, law: type, _: str) -> None:
        text = cleandoc(law.__doc__ or "")
        for name in ("source", "checked"):
            found = search(rf"\n{name.title()}: (.+?)(?=\n\s*\n|\n[A-Z]\w+:|\Z)", text, DOTALL)
            if found and not getattr(self, name):
                object.__setattr__(self, name, " ".join(found[1].split()).removesuffix("."))

    @property
    def formula(self) -> str:
        """Confidence in the formula as text, with the reference of the comparison."""
        text = f"{self.confidence} ({CONFIDENCE[self.confidence]})"
        return f"{text}: {self.checked}" if self.checked else text
