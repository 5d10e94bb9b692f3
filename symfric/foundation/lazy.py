"""Packages that import a module when one of its public names is first used.

`import symfric` therefore loads no laws, no mechanisms and no plotting library.
"""

import ast
import sys
from importlib import import_module
from types import ModuleType
from typing import Any


class LazyPackage(ModuleType):
    """Package whose public names are imported on first use."""

    _places: dict[str, str]

    def __getattr__(self, name: str) -> Any:
        """Import and return the public name or the submodule `name`."""
        found, submodule = None, f"{self.__name__}.{name}"
        if name in self._places:
            found = getattr(import_module(self._places[name]), name)
        elif not name.startswith("_"):
            try:
                found = import_module(submodule)
            except ModuleNotFoundError as error:
                if error.name != submodule:
                    raise
        if found is None:
            raise AttributeError(
                f"module {self.__name__!r} has no attribute {name!r}", name=name, obj=self
            )
        self.__dict__[name] = found
        return found

    def __setattr__(self, name: str, value: object) -> None:
        """Set an attribute, unless it is a submodule with the name of a public object."""
        if not (isinstance(value, ModuleType) and name in self._places):
            super().__setattr__(name, value)

    def __dir__(self) -> list[str]:
        return sorted({*(n for n in super().__dir__() if n.startswith("__")), *self._places})


def load_lazily(package: str) -> None:
    """Make the names that a package imports for type checkers available on first use.

    The imports in the block `if TYPE_CHECKING:` of its source are the only list of public names;
    `from module import *` means `module.__all__`. The source must be installed.

    Args:
        package: `__name__` of the package.
    """
    module = sys.modules[package]
    source = vars(module)["__loader__"].get_source(package)
    places: dict[str, str] = {}
    for block in ast.parse(source).body:
        if isinstance(block, ast.If):
            for line in block.body:
                if isinstance(line, ast.ImportFrom) and line.module:
                    names = [alias.asname or alias.name for alias in line.names]
                    names = import_module(line.module).__all__ if names == ["*"] else names
                    places |= dict.fromkeys(names, line.module)
    module.__dict__["_places"] = places
    module.__dict__["__all__"] = [*places]
    module.__class__ = LazyPackage
