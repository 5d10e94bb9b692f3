"""Bad values by the kind of argument, and what entry points do with them."""

import re
import warnings
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

import casadi as ca
import numpy as np
import pytest

from symfric import SolveError
from symfric.foundation.checks import shown

NAN, INF = float("nan"), float("inf")
SENTENCE = re.compile(r": (expected .+, got |.*; expected)", re.DOTALL)
FOREIGN = re.compile(r"\.cpp|\.hpp|overloaded|Sparsit|internal error|Traceback")


class Thing:
    """An object that no entry point accepts."""

    def __repr__(self) -> str:
        return "a thing"


def number(*more: Any, optional: bool = False) -> list[Any]:
    """What is no finite number; `more` is out of bounds."""
    none = [] if optional else [None]
    wrong = ["0.1", [0.1], {"a": 1}, Thing(), True, 1j, float, ca.SX.sym("s")]
    return [*none, *wrong, NAN, INF, -INF, np.array([0.1, 0.2]), np.datetime64("2020-01-01"), *more]


def parameter(*more: Any) -> list[Any]:
    """What is neither a finite number nor a symbol."""
    rows = [np.array([0.1, NAN]), np.array(["a"]), np.zeros(0), *(np.array([x, x]) for x in more)]
    return [x for x in number(*more) if not isinstance(x, ca.SX | np.ndarray)] + rows


def count(*more: Any, optional: bool = False) -> list[Any]:
    """What is no whole number of at least one."""
    return [*number(optional=optional), 1.5, 0, -1, *more]


def flag() -> list[Any]:
    return [None, 1, 0.0, "yes", [], Thing(), np.array([True, False])]


def choice() -> list[Any]:
    return [None, 3, ["auto"], "", "nonsense", True, Thing(), str]


def values(name: str, *more: Any) -> list[Any]:
    """What is no mapping from known names to numbers; `name` is a known one."""
    outside = [3, name, [(name, 1)], Thing(), True, {"nonsense": 1.0}, {3: 1.0}, {None: 1.0}]
    return [*outside, *({name: x} for x in number()), *more]


def each(name: str, *wrong: Any) -> list[Any]:
    """A mapping with one name for each of these values."""
    return [{name: x} for x in wrong]


def vectors(*more: Any) -> list[Any]:
    """What is no row of three finite numbers."""
    wrong = (NAN, INF, None, "a", 1j)
    return [None, 3, "abc", (1.0,), Thing(), *((1.0, x, 1.0) for x in wrong), *more]


def expression(*more: Any) -> list[Any]:
    """What is no expression of a model."""
    return [None, "x", Thing(), 1j, ca.SX.sym("a"), ca.MX.sym("a"), *more]


def names(known: str) -> list[Any]:
    return [3, known, ["nonsense"], [3], [None], Thing(), [known, known], True, [[known]]]


def times(*more: Any) -> list[Any]:
    rows = [[], [NAN], [0.0, INF], [0.01, 0.005], [0.0, 0.0], [[0.0, 0.01]], [None], ["a"], [1j]]
    return [3.0, "abc", *rows, {}, Thing(), 1j, True, [True, False], {0.0, 0.01}, *more]


def path() -> list[Any]:
    return [3, "", b"x", [], Thing(), "a\0b", True]


def thing(*more: Any) -> list[Any]:
    """What is no object of the required kind."""
    return [None, 3, "nonsense", [], {}, Thing(), object, *more]


def function(*more: Any) -> list[Any]:
    return [3, "f", [], {}, Thing(), True, *more]


@dataclass(frozen=True)
class EntryPoint:
    """A public function with good arguments, and the bad ones to try instead, one by one."""

    name: str
    call: Callable[..., Any]
    good: Mapping[str, Any]
    bad: Mapping[str, list[Any]]

    def cases(self) -> Iterator[tuple[str, Callable[[], Any]]]:
        """Text and call of every case."""
        for argument, tried in self.bad.items():
            for value in tried:
                arguments = dict(self.good) | {argument: value}
                yield f"{self.name}({argument}={_text(value)})", partial(self.call, **arguments)


def entry_point(
    call: Callable[..., Any], *about: str | Mapping[str, Any], **bad: list[Any]
) -> EntryPoint:
    """Return a public function with its bad values; `about` are its name and good arguments."""
    names = [one for one in about if isinstance(one, str)] or [getattr(call, "__qualname__", "")]
    good = [one for one in about if not isinstance(one, str)] or [{}]
    return EntryPoint(names[0], call, good[0], bad)


def listed(table: Mapping[str, dict[str, str]], names: Mapping[str, Any]) -> Iterator[EntryPoint]:
    """Yield the entry points of a TOML table, whose texts are expressions of `names`."""
    known = globals() | dict(names)
    for name, row in table.items():
        if row.get("call") == "":
            continue  # arguments that other rows share
        row = {"call": name} | row
        while "like" in row:
            row = table[row.pop("like")] | row
        found = {argument: eval(text, known) for argument, text in row.items()}
        yield EntryPoint(name, found.pop("call"), found.pop("good", {}), found)


def _text(value: Any) -> str:
    if isinstance(value, dict):
        return "{" + ", ".join(f"{k!r}: {shown(v)}" for k, v in value.items()) + "}"
    return shown(value)


def verdict(call: Callable[[], Any]) -> str:
    """ "refused" in a sentence, "solve failed", "accepted", or the foreign exception."""
    try:
        call()
    except SolveError:
        return "solve failed"
    except ValueError as error:
        text = str(error)
        if type(error) is not ValueError:
            return f"{type(error).__name__}: {text[:150]}"
        if not SENTENCE.search(text) or FOREIGN.search(text):
            return f"no sentence: {text[:150]}"
        return "refused" if len(text) < 1500 else f"too long: {text[:150]}"
    except Exception as error:  # noqa: BLE001  (whatever comes is the finding)
        return f"{type(error).__name__}: {str(error)[:150]}"
    return "accepted"


def verdicts(made: Iterator[EntryPoint]) -> list[tuple[str, str]]:
    """Cases and verdicts."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        return [(text, verdict(call)) for entry_point in made for text, call in entry_point.cases()]


def entry_points_refuse(
    groups: Mapping[str, Callable[[], Iterator[EntryPoint]]],
) -> Callable[..., None]:
    """Return the test that no entry point of any group accepts a bad value, in an empty folder."""

    @pytest.mark.parametrize("group", groups)
    def test(group: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
        monkeypatch.chdir(tmp_path)
        refuses_all(groups[group](), tmp_path)

    return test


def refuses_all(entry_points: Iterator[EntryPoint], folder: Path) -> None:
    """No case is accepted, fails with a foreign exception or leaves a file in `folder`."""
    found = verdicts(entry_points)
    wrong = [f"{text}: {outcome}" for text, outcome in found if outcome != "refused"]
    assert found
    assert not wrong, f"{len(wrong)} of {len(found)}:\n" + "\n".join(wrong)
    assert not list(folder.iterdir())
