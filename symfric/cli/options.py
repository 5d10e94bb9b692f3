"""Conversion of options: assignments, laws with settings, output files, Python files of users."""

import runpy
import traceback
from collections.abc import Callable, Generator, Iterable, Mapping, Sequence
from concurrent.futures import Executor, ProcessPoolExecutor
from contextlib import AbstractContextManager, contextmanager, nullcontext
from dataclasses import replace
from inspect import isclass, isfunction, signature
from pathlib import Path
from typing import Any, TypeVar

from symfric import Law, any_from_text, law_from_text, parameters, with_values
from symfric.cli.app import TEXTS
from symfric.foundation import checks
from symfric.foundation.files import check_file
from symfric.foundation.parameters import check_names, options
from symfric.foundation.status import SolveError
from symfric.laws import AnyLaw

L = TypeVar("L", Law, AnyLaw)
Strings = list[str] | None
PICTURES = (".png", ".pdf", ".svg", ".jpg")
MOST_WORKERS = 256


def processes(workers: int) -> AbstractContextManager[Executor | None]:
    """Return an executor of --workers processes; None within the context of one."""
    checks.count("--workers", workers, most=MOST_WORKERS)
    return nullcontext() if workers == 1 else ProcessPoolExecutor(workers)


def assignments(option: str, texts: Iterable[str] | None) -> dict[str, str]:
    """Return the values of `NAME=VALUE` texts by name.

    Raises:
        ValueError: a text without name or value, or a repeated name.
    """
    found: dict[str, str] = {}
    for text in texts or ():
        name, equals, value = (part.strip() for part in text.partition("="))
        if not (name and equals and value):
            raise ValueError(f"{option}: expected NAME=VALUE, got '{text}'; such as mu_s=0.2")
        if name in found:
            raise ValueError(f"{option}: expected every name once, got {name} twice")
        found[name] = value
    return found


def numbers(option: str, texts: dict[str, str] | Iterable[str] | None) -> dict[str, float]:
    """Return the numbers of `NAME=NUMBER` texts, or of their `assignments`, by name."""
    given = texts if isinstance(texts, dict) else assignments(option, texts)
    return {name: checks.parsed(f"{option} {name}", value) for name, value in given.items()}


def named_law(text: str) -> Law:
    """Return the law given by a text, which may contain laws of files, FILE.py:NAME."""
    return law_from_text(text, _of_file)


def any_named_law(text: str) -> AnyLaw:
    """Return the law or population given by a text; see `named_law`."""
    return any_from_text(text, _of_file)


def _of_file(text: str) -> Law:
    """Return the law FILE.py:NAME: a law, or the result of a class or function called without."""
    name, found = named_in_file("law", text, "law", lambda value: isinstance(value, Law))
    law = found() if callable(found) else found
    if not isinstance(law, Law):
        raise checks.refused(f"law '{text}'", f"a law, or a class or function of one, {name}", law)
    return law


def laws_of(texts: Sequence[str]) -> dict[str, Law]:
    """Return the laws of --law by text; it may be repeated or list several laws with commas.

    Raises:
        ValueError: an empty, repeated or unknown name.
    """
    laws = [part.strip() for text in texts for part in text.split(",")]
    if not all(laws):
        raise ValueError(f"--law: expected names of laws separated by commas, got '{texts[0]}'")
    if len(set(laws)) != len(laws):
        raise ValueError(f"--law: expected every law once, got {', '.join(laws)}")
    return {text: named_law(text) for text in laws}


def with_settings(law: L, text: str, settings: dict[str, str]) -> L:
    """Return `law`, named `text` in messages, with the parameters and options of `--set`."""
    check_names(f"--set of law {text}", settings, [*parameters(law), *options(law)])
    forms = {name: settings[name] for name in options(law) if name in settings}
    values = numbers("--set", {n: value for n, value in settings.items() if n not in forms})
    return with_values(replace(law, **forms) if forms else law, values)


def check_outputs(*paths: str | Path | None, picture: Path | None = None) -> None:
    """Check that output files can be written, before the computation starts.

    Raises:
        ValueError: a folder instead of a file, a missing permission, or an unknown picture format.
    """
    if picture and picture.suffix.lower() not in PICTURES:
        raise ValueError(
            f"output '{picture}': expected a picture ending in {', '.join(PICTURES)}, "
            f"got '{picture.suffix}'"
        )
    for path in (*paths, picture):
        if path is not None and str(path) != "-":
            check_file(path)


def called_with(text: str, make: Callable[..., Any], values: dict[str, float]) -> Any:
    """Return the result of a function called with the numbers of --set."""
    known = signature(make).parameters
    check_names(f"--set of {text}", values, list(known))
    needed = [n for n, p in known.items() if p.default is p.empty and "*" not in str(p)]
    if missing := [n for n in needed if n not in values]:
        what = "a function whose arguments have defaults or numbers of --set"
        raise ValueError(f"'{text}': expected {what}, got none for {', '.join(missing)}")
    return make(**values)


def changed(command: Callable[..., Any], given: Mapping[str, Any]) -> list[str]:
    """Return the arguments and options of a command that differ from their defaults."""
    texts = TEXTS["all"] | TEXTS[command.__name__]
    names = [n for n, p in signature(command).parameters.items() if given[n] != p.default]
    return [texts[name][0].split()[0].rpartition("/")[2] for name in names]


def held_by_file(
    command: str, text: str, default: str, values: dict[str, float], wanted: str, kind: Any
) -> Any:
    """Return the object FILE.py[:NAME]; if it is a function, its result with --set as arguments.

    Args:
        command: name of the command for messages.
        text: FILE.py or FILE.py:NAME.
        default: name of the object if `text` names none.
        values: numbers of --set.
        wanted: name of the expected type in messages.
        kind: expected types.

    Raises:
        ValueError: a missing file or name, an error in the file, unknown names in --set, or an
            object of another type.
    """
    name, found = named_in_file(command, text, default, lambda value: isinstance(value, kind))
    if callable(found):
        found = called_with(text, found, values)
    elif values:
        raise ValueError(f"--set: expected none for '{name}', which is no function")
    if not isinstance(found, kind):
        what = f"a {wanted}, or a function that returns one"
        raise checks.refused(f"{command} '{text}'", what, found)
    return found


def named_in_file(
    command: str, text: str, default: str, fits: Callable[[Any], bool]
) -> tuple[str, Any]:
    """Return the name in FILE.py[:NAME] and its object; errors of a function state the line.

    Raises:
        ValueError: a missing file, an error in the file, or a missing name; the message lists
            suitable objects and the public functions and classes of the file.
    """
    path, _, name = text.partition(".py")
    file, name = Path(f"{path}.py"), name.removeprefix(":") or default
    if not file.is_file():
        raise ValueError(f"{command}: expected a Python file, got '{file}', which does not exist")
    if not name.isidentifier():
        raise checks.refused(command, "FILE.py:NAME, and --set for parameters", text)
    with errors_with_line(command, file):
        every = runpy.run_path(str(file))
    if name not in every:
        own = [
            n
            for n, value in every.items()
            if (
                value.__module__ == every["__name__"] and value.__name__[0] != "_"
                if isfunction(value) or isclass(value)
                else fits(value)
            )
        ]
        hint = f"; it holds {', '.join(own)}" if own else "; name one after a colon"
        raise ValueError(f"{command}: expected '{name}' in '{file}', got none{hint}")
    found = every[name]
    if callable(found) and not isclass(found):
        found = errors_with_line(command, file, ValueError, SolveError)(found)
    return name, found


@contextmanager
def errors_with_line(command: str, file: Path, *plain: type[Exception]) -> Generator[None]:
    """Add the line number to errors of a user's file, except those of the types `plain`."""
    try:
        yield
    except plain:
        raise
    except (Exception, SystemExit) as error:
        frames = reversed(traceback.extract_tb(error.__traceback__))
        own = getattr(error, "lineno", None)  # for syntax errors
        line = next((f.lineno for f in frames if f.filename == str(file)), own)
        place = f" in line {line}" * bool(line)
        got = f"{type(error).__name__}{place} of '{file}': {error}"
        raise ValueError(f"{command}: expected a file that runs, got {got}") from error
