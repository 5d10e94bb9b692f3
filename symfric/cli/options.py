"""Options that several commands share, and what their texts mean."""

from collections.abc import Iterable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Annotated, TypeVar

import typer

from symfric import Law, law_from_text, parameters, with_values
from symfric.cli import completions
from symfric.foundation import checks
from symfric.foundation.files import check_file
from symfric.foundation.files import check_folder as check_folder
from symfric.foundation.parameters import check_names, options
from symfric.laws import AnyLaw, any_from_text

JsonOption = Annotated[
    str | None,
    typer.Option("--json", metavar="FILE|-", help="Write JSON; - prints it and nothing else."),
]
MissingOption = Annotated[
    str,
    typer.Option(
        "--missing",
        metavar="refuse|drop",
        help="Rows in which a channel has no number, or that repeat the one before: drop them.",
    ),
]
ResampleOption = Annotated[
    bool, typer.Option("--resample", help="Equal intervals; a long gap begins another record.")
]
PlotOption = Annotated[
    Path | None, typer.Option("--plot", metavar="FILE.png", help="Write a picture.")
]
HtmlOption = Annotated[
    Path | None, typer.Option("--html", metavar="FILE.html", help="Write one page of it all.")
]
RtolOption = Annotated[
    float, typer.Option("--rtol", metavar="NUMBER", help="Relative tolerance of a step.")
]
StartOption = Annotated[
    list[str] | None,
    typer.Option("--x0", metavar="NAME=VALUE", help="Start value of a state."),
]
WorkersOption = Annotated[
    int | None, typer.Option("--workers", metavar="N", help="Processes; default one a core.")
]
SetOption = Annotated[
    list[str] | None,
    typer.Option(
        "--set",
        metavar="NAME=VALUE",
        help="Set a parameter; may be repeated.",
        autocompletion=completions.settings,
    ),
]


L = TypeVar("L", Law, AnyLaw)


def assignments(option: str, texts: Iterable[str] | None) -> dict[str, str]:
    """`NAME=VALUE` texts by name.

    Raises:
        ValueError: a text without name or value, or a name given twice.
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
    """`NAME=NUMBER` texts by name."""
    given = assignments(option, texts)
    return {name: checks.parsed(f"{option} {name}", value) for name, value in given.items()}


def seconds(option: str, text: str | None) -> list[float]:
    """Times [s] separated by commas."""
    parts = [] if text is None else text.split(",")
    return [checks.parsed(option, part.strip()) for part in parts]


def law_names(texts: Sequence[str]) -> list[str]:
    """Laws of --law, which is repeated or holds several with commas, each once.

    Raises:
        ValueError: none, one twice, or one that is not known.
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
    """The law or population that `text` names, with the parameters and options of `--set`."""
    return with_settings(any_from_text(text), text, settings)


def all_with(texts: Sequence[str], settings: Iterable[str] | None) -> list[AnyLaw]:
    """The laws that `texts` name, all with the parameters and options of `--set`.

    `LAW.NAME=VALUE` sets the parameter of one of them only.

    Raises:
        ValueError: a name that one of them does not have; it says which.
    """
    laws = [(text, any_from_text(text)) for text in texts]
    chosen: list[dict[str, str]] = [{} for _ in laws]
    lacking: list[str] = []
    given = assignments("--set", settings)
    for name in sorted(given, key=lambda name: "." in name):  # what is for one law comes last
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
    """`law`, called `text`, with the parameters and options of `--set`."""
    given = assignments("--set", settings)
    check_names(f"--set of law {text}", given, [*parameters(law), *options(law)])
    forms = {name: given.pop(name) for name in options(law) if name in given}
    values = {name: checks.parsed(f"--set {name}", value) for name, value in given.items()}
    return with_values(replace(law, **forms) if forms else law, values)


PICTURES = (".png", ".pdf", ".svg", ".jpg")


def check_outputs(*paths: str | Path | None, picture: Path | None = None) -> None:
    """Refuse output places that cannot be written, before any work is spent on them.

    Raises:
        ValueError: a folder in the place of a file, a place without permission, or a kind of
            picture that is not drawn.
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
