"""Fronts of packages that load a room when somebody asks for what is in it (PEP 562).

`import symfric` then costs what is used: no law, no mechanism, no picture before its name is read.
"""

import ast
import sys
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
        return sorted({*(n for n in super().__dir__() if n.startswith("__")), *self._places})


def hand_out(package: str) -> None:
    """Make the front of `package` hand out the names that its source imports for type checkers.

    These imports stand in `if TYPE_CHECKING:`, so that each name is written once; the front has to
    be installed with its source.

    Args:
        package: `__name__` of the front.
    """
    front = sys.modules[package]
    source = vars(front)["__loader__"].get_source(package)
    found: dict[str, str] = {}
    for block in ast.parse(source).body:
        if isinstance(block, ast.If):
            for line in block.body:
                if isinstance(line, ast.ImportFrom) and line.module:
                    names = [alias.asname or alias.name for alias in line.names]
                    names = import_module(line.module).__all__ if names == ["*"] else names
                    found |= dict.fromkeys(names, line.module)
    front.__dict__["_places"] = found
    front.__dict__["__all__"] = [*found]
    front.__class__ = Front
