"""A model or problem that stands in a Python file of the user: FILE.py, or FILE.py:NAME."""

import runpy
import traceback
from collections.abc import Callable, Mapping
from functools import partial, wraps
from inspect import isclass, isfunction, signature
from pathlib import Path
from typing import Any

from symfric.foundation import checks
from symfric.foundation.parameters import check_names
from symfric.foundation.status import SolveError


def held_by_file(
    command: str, text: str, default: str, values: dict[str, float], wanted: str, kind: Any
) -> Any:
    """What FILE.py[:NAME] holds, or what the function of that name makes of the numbers of --set.

    Args:
        command: who asks.
        text: FILE.py or FILE.py:NAME.
        default: the name where none is given.
        values: of --set.
        wanted, kind: what it is to be, in words and as types.

    Raises:
        ValueError: no such file or name, a file that fails, numbers that do not fit, something else
            than what is wanted.
    """
    name, held = _named(command, text, default, lambda value: isinstance(value, kind))
    found = held[name]
    if callable(found):
        found = made(text, _with_line(command, held, found), values)
    elif values:
        raise ValueError(f"--set: expected none for '{name}', which is no function")
    if not isinstance(found, kind):
        what = f"a {wanted}, or a function that returns one"
        raise checks.refused(f"{command} '{text}'", what, found)
    return found


def function_of_file(command: str, text: str, default: str, values: dict[str, float]) -> Any:
    """What FILE.py[:NAME] holds and can be called, with the numbers of --set as its keywords.

    Raises:
        ValueError: no such file or name, a file that fails, numbers that do not fit.
    """
    name, held = _named(command, text, default, callable)
    found = held[name]
    if not callable(found):
        raise checks.refused(f"{command} '{text}'", "a function law -> Model, or a scene", found)
    first, *others = signature(found).parameters or [""]
    check_names(f"--set of {text}, a function of {first}", values, others)
    own = _with_line(command, held, found)
    return partial(own, **values) if values else own


def _with_line(command: str, held: Mapping[str, Any], function: Callable[..., Any]) -> Any:
    """The function of a user's file; an error in it names its line in that file."""
    if isclass(function):
        return function

    @wraps(function)
    def called(*given: Any, **named: Any) -> Any:
        try:
            return function(*given, **named)
        except (ValueError, SolveError):
            raise
        except Exception as error:
            raise _failed(command, Path(held["__file__"]), error) from error

    return called


def _named(
    command: str, text: str, default: str, fits: Callable[[Any], bool]
) -> tuple[str, dict[str, Any]]:
    """The name that FILE.py[:NAME] means, and all that the file holds.

    Raises:
        ValueError: no such file, a file that fails, no such name; it says which ones fit.
    """
    path, _, name = text.partition(".py")
    file, name = Path(f"{path}.py"), name.removeprefix(":") or default
    if not file.is_file():
        raise ValueError(f"{command}: expected a Python file, got '{file}', which does not exist")
    held = _run(command, file)
    if name not in held:
        there = [n for n, value in held.items() if _meant(value, held, fits)]
        hint = f"; it holds {', '.join(there)}" if there else "; name one after a colon"
        raise ValueError(f"{command}: expected '{name}' in '{file}', got none{hint}")
    return name, held


def _meant(value: object, held: Mapping[str, Any], fits: Callable[[Any], bool]) -> bool:
    """Whether a name may be offered: what fits, and public functions of the file itself."""
    if isfunction(value) or isclass(value):
        return value.__module__ == held["__name__"] and value.__name__[0] != "_"
    return fits(value)


def _run(command: str, file: Path) -> dict[str, Any]:
    """The names of a file that was run; an error in it says its line."""
    try:
        return runpy.run_path(str(file))
    except Exception as error:
        raise _failed(command, file, error) from error


def _failed(command: str, file: Path, error: Exception) -> ValueError:
    """The error that names the line of a user's file."""
    frames = reversed(traceback.extract_tb(error.__traceback__))
    own = getattr(error, "lineno", None)  # of a syntax error
    line = next((f.lineno for f in frames if f.filename == str(file)), own)
    return ValueError(
        f"{command}: expected a file that runs, got {type(error).__name__} in line {line} of "
        f"'{file}': {error}"
    )


def made(text: str, make: Any, values: dict[str, float]) -> Any:
    """What a function makes of the numbers of --set."""
    check_names(f"--set of {text}", values, list(signature(make).parameters))
    return make(**values)
