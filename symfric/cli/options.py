"""Options shared by several commands, conversion of their texts, and Python files of the user."""

import runpy
import traceback
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import replace
from functools import partial, wraps
from inspect import isclass, isfunction, signature
from pathlib import Path
from typing import Annotated, Any, TypeVar

import typer

from symfric import Law, law_from_text, parameters, with_values
from symfric.cli import completions
from symfric.foundation import checks
from symfric.foundation.files import check_file
from symfric.foundation.files import check_folder as check_folder
from symfric.foundation.parameters import check_names, options
from symfric.foundation.status import SolveError
from symfric.laws import AnyLaw, any_from_text


def option(
    words: str,
    meaning: str,
    completion: Callable[..., list[str]] | None = None,
    metavar: str | None = None,
) -> Any:
    """Declare an option by its names and the placeholder of its value, such as "--rtol NUMBER"."""
    names = [word for word in words.split() if word.startswith("--")]
    value = " ".join(word for word in words.split() if not word.startswith("--"))
    return typer.Option(
        *names, metavar=metavar or value or None, help=meaning, autocompletion=completion
    )


def argument(metavar: str, meaning: str, completion: Callable[..., list[str]] | None = None) -> Any:
    """Declare a positional argument."""
    return typer.Argument(metavar=metavar, help=meaning, autocompletion=completion)


JsonOption = Annotated[
    str | None, option("--json FILE|-", "Write JSON; - prints it and nothing else.")
]
MissingOption = Annotated[
    str,
    option(
        "--missing refuse|drop",
        "Refuse or drop rows with a missing number, and repeated rows.",
    ),
]
ResampleOption = Annotated[
    bool, option("--resample", "Resample to equal intervals; a long gap starts a new record.")
]
PlotOption = Annotated[Path | None, option("--plot FILE.png", "Write a picture.")]
HtmlOption = Annotated[Path | None, option("--html FILE.html", "Write an HTML page.")]
RtolOption = Annotated[float, option("--rtol NUMBER", "Relative tolerance of a step.")]
StartOption = Annotated[list[str] | None, option("--x0 NAME=VALUE", "Start value of a state.")]
WorkersOption = Annotated[int | None, option("--workers N", "Processes; default: one per core.")]
SetOption = Annotated[
    list[str] | None,
    option("--set NAME=VALUE", "Set a parameter; may be repeated.", completions.settings),
]


ColumnOption = Annotated[
    list[str] | None, option("--column SIGNAL=NAME", "Column of a signal; or all: t,x,-,F.")
]
UnitOption = Annotated[
    list[str] | None, option("--unit SIGNAL=UNIT", 'Unit of a column; or all: "rad, N m".')
]
NormalForceOption = Annotated[
    float, option("--normal-force NUMBER", "Normal force [N]; with 1, coefficients are forces.")
]
InputOption = Annotated[
    list[str] | None,
    option(
        "--input NAME=VALUE",
        "Input: a number, or FILE.csv:COLUMN over its column t, both in SI or with units in the "
        "header, as t [ms]; default: the input of the scene, see `symfric scenes SCENE`.",
    ),
]
EndOption = Annotated[
    float | None,
    option("--t-end SECONDS", "End time [s]; default: the last sample, or that of the scene."),
]

L = TypeVar("L", Law, AnyLaw)


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


def numbers(option: str, texts: Iterable[str] | None) -> dict[str, float]:
    """Return the numbers of `NAME=NUMBER` texts by name."""
    given = assignments(option, texts)
    return {name: checks.parsed(f"{option} {name}", value) for name, value in given.items()}


def seconds(option: str, text: str | None) -> list[float]:
    """Return times [s] separated by commas."""
    parts = [] if text is None else text.split(",")
    return [checks.parsed(option, part.strip()) for part in parts]


def law_names(texts: Sequence[str]) -> list[str]:
    """Return the laws of --law, which may be repeated or hold several names with commas.

    Raises:
        ValueError: an empty, repeated or unknown name.
    """
    laws = [part.strip() for text in texts for part in text.split(",")]
    if not all(laws):
        raise ValueError(f"--law: expected names of laws separated by commas, got '{texts[0]}'")
    if len(set(laws)) != len(laws):
        raise ValueError(f"--law: expected every law once, got {', '.join(laws)}")
    for name in laws:
        law_from_text(name)
    return laws


def any_with(text: str, settings: Iterable[str] | None) -> AnyLaw:
    """Return the law or population `text` with the parameters and options of `--set`."""
    return with_settings(any_from_text(text), text, settings)


def all_with(texts: Sequence[str], settings: Iterable[str] | None) -> list[AnyLaw]:
    """Return the laws `texts`, all with the parameters and options of `--set`.

    `LAW.NAME=VALUE` sets the parameter of one law only.

    Raises:
        ValueError: a name that one of them does not have.
    """
    laws = [(text, any_from_text(text)) for text in texts]
    chosen: list[dict[str, str]] = [{} for _ in laws]
    lacking: list[str] = []
    given = assignments("--set", settings)
    for name in sorted(given, key=lambda name: "." in name):  # settings of one law come last
        only, _, own = name.rpartition(".")
        check_names(f"--set {name}", [only] if only else [], texts)
        for (text, law), values in zip(laws, chosen, strict=True):
            if only in ("", text):
                values[own] = given[name]
            if not only and own not in {*parameters(law), *options(law)}:
                lacking.append(f"{own}, which {text} does not have")
    if lacking and len(laws) > 1:
        raise ValueError(
            f"--set: expected what {' and '.join(texts)} all have, got {'; '.join(lacking)}; "
            f"--set {texts[0]}.NAME=VALUE is for one law"
        )
    return [
        with_settings(law, text, [f"{name}={value}" for name, value in values.items()])
        for (text, law), values in zip(laws, chosen, strict=True)
    ]


def with_settings(law: L, text: str, settings: Iterable[str] | None) -> L:
    """Return `law`, named `text` in messages, with the parameters and options of `--set`."""
    given = assignments("--set", settings)
    check_names(f"--set of law {text}", given, [*parameters(law), *options(law)])
    forms = {name: given.pop(name) for name in options(law) if name in given}
    values = {name: checks.parsed(f"--set {name}", value) for name, value in given.items()}
    return with_values(replace(law, **forms) if forms else law, values)


PICTURES = (".png", ".pdf", ".svg", ".jpg")


def check_outputs(*paths: str | Path | None, picture: Path | None = None) -> None:
    """Check before the work starts that output files can be written.

    Raises:
        ValueError: a folder instead of a file, a missing permission, or an unknown picture format.
    """
    if picture and picture.suffix.lower() not in PICTURES:
        raise ValueError(
            f"output '{picture}': expected a picture ending in {', '.join(PICTURES)}, "
            f"got '{picture.suffix}'"
        )
    for path in (*paths, picture):
        if path is None or str(path) == "-":
            continue
        check_file(path)


def held_by_file(
    command: str, text: str, default: str, values: dict[str, float], wanted: str, kind: Any
) -> Any:
    """Return the object in FILE.py[:NAME], or the result of that function with --set as arguments.

    Args:
        command: name of the command for messages.
        text: FILE.py or FILE.py:NAME.
        default: name if none is given.
        values: numbers of --set.
        wanted: expected type in words.
        kind: expected types.

    Raises:
        ValueError: no such file or name, an error in the file, unknown names in --set, or an object
            of another type.
    """
    name, held = _named(command, text, default, lambda value: isinstance(value, kind))
    found = held[name]
    if callable(found):
        found = called_with(text, _with_line(command, held, found), values)
    elif values:
        raise ValueError(f"--set: expected none for '{name}', which is no function")
    if not isinstance(found, kind):
        what = f"a {wanted}, or a function that returns one"
        raise checks.refused(f"{command} '{text}'", what, found)
    return found


def function_of_file(command: str, text: str, default: str, values: dict[str, float]) -> Any:
    """Return the callable in FILE.py[:NAME], with the numbers of --set as keyword arguments.

    Raises:
        ValueError: no such file or name, an error in the file, or unknown names in --set.
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
    """Wrap a function of a user's file so that its errors name their line in that file."""
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
    """Return the name in FILE.py[:NAME], and all names of the file.

    Raises:
        ValueError: no such file, an error in the file, or no such name; lists suitable names.
    """
    path, _, name = text.partition(".py")
    file, name = Path(f"{path}.py"), name.removeprefix(":") or default
    if not file.is_file():
        raise ValueError(f"{command}: expected a Python file, got '{file}', which does not exist")
    held = _names_of(command, file)
    if name not in held:
        there = [n for n, value in held.items() if _meant(value, held, fits)]
        hint = f"; it holds {', '.join(there)}" if there else "; name one after a colon"
        raise ValueError(f"{command}: expected '{name}' in '{file}', got none{hint}")
    return name, held


def _meant(value: object, held: Mapping[str, Any], fits: Callable[[Any], bool]) -> bool:
    """Return True for names to suggest: suitable objects, and public functions of the file."""
    if isfunction(value) or isclass(value):
        return value.__module__ == held["__name__"] and value.__name__[0] != "_"
    return fits(value)


def _names_of(command: str, file: Path) -> dict[str, Any]:
    """Run a file and return its names; an error names its line."""
    try:
        return runpy.run_path(str(file))
    except Exception as error:
        raise _failed(command, file, error) from error


def _failed(command: str, file: Path, error: Exception) -> ValueError:
    """Return an error that names the line of a user's file."""
    frames = reversed(traceback.extract_tb(error.__traceback__))
    own = getattr(error, "lineno", None)  # for syntax errors
    line = next((f.lineno for f in frames if f.filename == str(file)), own)
    return ValueError(
        f"{command}: expected a file that runs, got {type(error).__name__} in line {line} of "
        f"'{file}': {error}"
    )


def called_with(text: str, make: Any, values: dict[str, float]) -> Any:
    """Call a function with the numbers of --set."""
    check_names(f"--set of {text}", values, list(signature(make).parameters))
    return make(**values)
