"""Fronts of packages that load a room when somebody asks for what is in it (PEP 562).

`import symfric` then costs what is used: no law, no mechanism, no picture before its name is read.
"""

import sys
from collections.abc import Mapping
from importlib import import_module
from types import ModuleType
from typing import Any


class Front(ModuleType):
    """A package that hands out names of its rooms; each room is loaded at the first of them."""

    _places: dict[str, str]

    def __getattr__(self, name: str) -> Any:
        """The object called `name`, from its room; or the room of that name."""
        place = self._places.get(name)
        if place is not None:
            found = getattr(import_module(place), name)
        else:
            found = None if name.startswith("_") else self._room(name)
            if found is None:
                raise AttributeError(
                    f"module {self.__name__!r} has no attribute {name!r}", name=name, obj=self
                )
        self.__dict__[name] = found
        return found

    def _room(self, name: str) -> ModuleType | None:
        whole = f"{self.__name__}.{name}"
        try:
            return import_module(whole)
        except ModuleNotFoundError as error:
            if error.name != whole:
                raise
            return None

    def __setattr__(self, name: str, value: object) -> None:
        """Set an attribute; a room that is called as what it hands out does not stand for it."""
        if not (isinstance(value, ModuleType) and name in self._places):
            super().__setattr__(name, value)

    def __dir__(self) -> list[str]:
        return sorted({*super().__dir__(), *self._places})


def hand_out(package: str, names: Mapping[str, str]) -> None:
    """Make the front of `package` hand out `names`, loaded on demand.

    Args:
        package: `__name__` of the front.
        names: module -> the names it has, separated by blanks.
    """
    front = sys.modules[package]
    front.__dict__["_places"] = {name: at for at, text in names.items() for name in text.split()}
    front.__dict__["__all__"] = [*front.__dict__["_places"]]
    front.__class__ = Front
