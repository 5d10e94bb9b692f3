"""Argument validation for the public API.

The first argument of every check is `where`, the name of the argument in messages, such as
"simulate: rtol". A check returns the value in the required type or raises an error with one
sentence:

    <where>: expected <what>, got <value>; <hint>

Numbers are int, float, NumPy scalars of any real type, 0-d arrays, and constant CasADi scalars.
Booleans, strings and complex numbers are not accepted.
"""

import operator
import sys
import unicodedata
from collections.abc import Collection, Iterable, Mapping
from difflib import get_close_matches
from math import inf, isfinite
from numbers import Real
from os import PathLike, fspath
from pathlib import Path
from re import ASCII, sub
from typing import Any, TypeVar

import casadi as ca
import numpy as np

from symfric.foundation.numeric import Array
from symfric.foundation.shown import Showing
from symfric.foundation.symbolic import Symbolic, plain

T = TypeVar("T")

LONGEST = 60
"""Largest length of a value shown in an error [characters]."""
LONGEST_LINE = 200
"""Largest length of a name [characters]."""
LISTED = 32
"""Largest number of known names listed in an error."""


def refused(where: str, what: str, value: object, hint: str = "") -> ValueError:
    """Return the error that states the expected and the given value."""
    return ValueError(f"{where}: expected {what}, got {shown(value)}" + (f"; {hint}" * bool(hint)))


def shown(value: object) -> str:
    """Return a short description of a value of any type."""
    if isinstance(value, type):
        return f"the class {value.__name__}"
    if isinstance(value, np.ndarray) and value.ndim:
        kind = "" if value.dtype.kind in "iuf" else f" of {value.dtype}"
        return f"an array of shape {value.shape}{kind}"
    if isinstance(value, ca.SX | ca.MX):
        size = "" if value.numel() == 1 else f" of shape {value.shape}"
        kind = "MX expression" if isinstance(value, ca.MX) else "expression"
        return f"the {kind} {_cut(str(value))}{size}"
    if isinstance(value, np.generic | np.ndarray):
        value = value.item()
    if isinstance(value, int) and value.bit_length() >= sys.float_info.max_exp:
        return f"an integer of {value.bit_length()} bits"
    if callable(value) and hasattr(value, "__name__"):
        return f"the function {value.__name__}"
    if isinstance(value, Showing):
        return _cut(value.shown().title)
    text = " ".join(repr(value).split()) if hasattr(value, "_repr_html_") else repr(value)
    if " at 0x" in text or "\n" in text:
        return f"an object of type {type(value).__name__}"
    return _cut(text.removeprefix("<").removesuffix(">") if text.startswith("<") else text)


def listed(names: Iterable[str], most: int = 6) -> str:
    """Return `names` joined by commas; beyond `most` names, only their number is added."""
    every = list(names)
    if len(every) <= most:
        return ", ".join(every)
    return f"{', '.join(every[:most])} and {len(every) - most} more"


def _cut(text: str) -> str:
    return text if len(text) <= LONGEST else f"{text[:LONGEST]}..."


def as_number(value: object) -> float | None:
    """Return `value` as a float, finite or not; None if it is not a number."""
    if type(value) is float:  # the usual case: a public function makes a dozen of these checks
        return value
    if isinstance(value, bool | np.bool_):
        return None
    if isinstance(value, Real):
        try:
            return float(value)
        except OverflowError:
            return inf  # an integer of more than 308 digits
    if isinstance(value, np.ndarray):
        return float(value) if value.ndim == 0 and value.dtype.kind in "iuf" else None
    if isinstance(value, ca.DM) or (isinstance(value, ca.SX) and value.is_constant()):
        return float(value) if value.is_scalar() else None
    return None


def number(
    where: str,
    value: object,
    *,
    unit: str = "",
    lower: float = -inf,
    upper: float = inf,
    above: float | None = None,
    hint: str = "",
) -> float:
    """Return `value` as a finite float.

    Args:
        where: name of the argument in the message.
        value: value to check.
        unit: unit in the message.
        lower, upper: closed bounds.
        above: open lower bound.
        hint: advice for the message.

    Raises:
        ValueError: `value` is not a number, is not finite, or is out of bounds.
    """
    found = as_number(value)
    good = found is not None and isfinite(found) and lower <= found <= upper
    if found is None or not good or (above is not None and not found > above):
        what = _bounded(lower, upper, above) + f" [{unit}]" * bool(unit)
        raise refused(where, what, value, hint)
    return found


def _bounded(lower: float, upper: float, above: float | None) -> str:
    """Return the description of a number within bounds."""
    if above is not None:
        return f"a number > {above:g}" + (f" and <= {upper:g}" if upper < inf else "")
    if lower > -inf and upper < inf:
        return f"{lower:g} <= number <= {upper:g}"
    if lower > -inf:
        return f"a number >= {lower:g}"
    return f"a number <= {upper:g}" if upper < inf else "a finite number"


def parsed(where: str, text: str) -> float:
    """Return the finite number in a string from a command line or a file."""
    try:
        found = None if "_" in text else float(text)
    except ValueError:
        found = None
    if found is None or not isfinite(found):
        raise refused(where, "a finite number", text)
    return found


def count(
    where: str, value: object, *, least: int = 1, most: int | None = None, hint: str = ""
) -> int:
    """Return `value` as an int; 1e6 is accepted.

    Raises:
        ValueError: `value` is not a whole number or is out of bounds.
    """
    found, real = None, as_number(value)
    if real is not None and isfinite(real) and real == int(real):
        found = operator.index(value) if isinstance(value, int | np.integer) else int(real)
    if found is None or found < least or (most is not None and found > most):
        bounds = f" >= {least}" if most is None else f" from {least} to {most}"
        raise refused(where, f"a whole number{bounds}", value, hint)
    return found


def expression(where: str, value: object) -> Any:
    """Return `value`, which must be SX, DM, a finite number or an array of finite numbers.

    A variable is replaced by its symbol.
    """
    value = plain(value)
    if isinstance(value, ca.SX | ca.DM):
        return value
    if isinstance(value, ca.MX):
        raise refused(where, "an SX expression", value, "models are written with casadi.SX")
    if isinstance(value, np.ndarray) and value.dtype.kind in "iuf" and np.isfinite(value).all():
        return value
    found = as_number(value)
    if found is None or not isfinite(found):
        hint = "write casadi.vertcat(...) for a column" * isinstance(value, list | tuple)
        raise refused(where, "an SX expression or a finite number", value, hint)
    return value


def flag(where: str, value: object) -> bool:
    """Return `value` as a bool; only True and False are accepted."""
    if isinstance(value, bool | np.bool_):
        return bool(value)
    raise refused(where, "True or False", value)


def text(where: str, value: object, what: str = "a text") -> str:
    """Return `value`, which must be a non-empty string."""
    if isinstance(value, str) and value.strip():
        return str(value)
    raise refused(where, what, value)


def identifier(where: str, value: object) -> str:
    """Return `value`, which must be a C identifier of ASCII letters, digits and underscores."""
    name = text(where, value, "a C identifier")
    if not (name.isascii() and name.isidentifier()):
        raise refused(where, "a C identifier", value, f"write {as_identifier(name)}")
    return name


def as_identifier(name: str) -> str:
    """Return a C identifier similar to a name, such as my_x for "my x" or phi for "φ"."""
    letters = (unicodedata.name(c, "").partition(" LETTER ")[2].lower() for c in name)
    plain_ones = (
        f"{'_' * (i > 0)}{letter.split()[0]}" if letter and not c.isascii() else c
        for i, (c, letter) in enumerate(zip(name, letters, strict=True))
    )
    found = sub(r"\W+", "_", "".join(plain_ones), flags=ASCII).strip("_") or "x"
    return f"x_{found}" if found[0].isdigit() else found


def line(where: str, value: object, what: str = "a text") -> str:
    """Return `value`, which must be one printable line, safe in headers, XML and file names."""
    found = text(where, value, what)
    if not found.isprintable() or len(found) > LONGEST_LINE:
        raise refused(where, f"{what} of one printable line", value)
    return found


def choice(where: str, value: object, choices: Collection[str]) -> str:
    """Return `value`, which must be one of `choices`; errors offer the nearest choice."""
    name: Any = value
    check_names(where, [name], choices)
    return name


def kind(where: str, value: object, wanted: type[T], such_as: str) -> T:
    """Return `value`, which must be an instance of `wanted`.

    `such_as` describes the expected value with an example: "a model, such as rabinowicz(LuGre())".
    """
    if isinstance(value, wanted):
        return value
    hint = ""
    if isinstance(value, type) and issubclass(value, wanted):
        hint = f"write {value.__name__}(...) with parentheses"
    raise refused(where, such_as, value, hint)


def named(where: str, value: object, known: Collection[str] | None = None) -> dict[str, Any]:
    """Return a mapping from names to values as a dict, empty for None.

    Names that are not in `known` raise an error. A variable as a key is replaced by its name.
    """
    if value is None:
        return {}
    if not isinstance(value, Mapping):
        raise refused(where, "values by name, such as {'v': 0.1}", value)
    given: dict[Any, Any] = {
        getattr(name, "name", name) if isinstance(name, Symbolic) else name: x
        for name, x in value.items()
    }
    odd = [name for name in given if not isinstance(name, str)]
    if odd:
        raise refused(where, "texts as names", odd[0])
    if known is not None:
        check_names(where, given, known)
    return given


def many(where: str, value: object, what: str) -> tuple[Any, ...]:
    """Return a sequence of `what` as a tuple; a string is not accepted."""
    if isinstance(value, str | bytes | ca.SX | ca.MX) or not isinstance(value, Iterable):
        name = getattr(value, "name", "")
        hint = f"write ({name},)" if isinstance(name, str) and name.isidentifier() else ""
        raise refused(where, f"a sequence of {what}", value, hint)
    return tuple(value)  # pyright: ignore[reportUnknownArgumentType, reportUnknownVariableType]


def names(where: str, value: object, known: Collection[str] | None = None) -> tuple[str, ...]:
    """Return a sequence of distinct names as a tuple; unknown names raise an error."""
    if isinstance(value, str):
        raise refused(where, "a sequence of names", value, f"write [{value!r}]")
    given = many(where, value, "names")
    if not given:
        return ()
    for name in given:
        text(where, name, "names")
    if len(set(given)) != len(given):
        raise ValueError(f"{where}: expected every name once, got {', '.join(given)}")
    if known is not None:
        check_names(where, given, known)
    return given


def array(
    where: str, value: object, *, ndim: int | None = 1, what: str = "", nan: bool = False
) -> Array:
    """Return `value` as an array of finite floats with `ndim` dimensions; None allows any number.

    `what` describes the numbers in messages; if `nan` is True, the numbers need not be finite.

    Raises:
        ValueError: `value` does not consist of numbers, is not finite, or has a wrong number of
            dimensions.
    """
    kinds = {0: "a number", 1: "a sequence of numbers", 2: "a matrix of numbers"}
    what = what or kinds.get(-1 if ndim is None else ndim, "numbers")
    if isinstance(value, ca.DM) or (isinstance(value, ca.SX) and value.is_constant()):
        value = ca.DM(value).full().squeeze()
    try:
        found = np.asarray(value)
    except (ValueError, TypeError, RuntimeError):  # ragged sequences, or errors of CasADi
        raise refused(where, what, value) from None
    if found.dtype.kind not in "iuf" and found.size:
        raise refused(where, what, value)
    if ndim is not None and found.ndim != ndim:
        raise refused(where, what, value)
    numbers = found.astype(float)
    if not nan and not np.isfinite(numbers).all():
        k = tuple(int(i) for i in np.argwhere(~np.isfinite(numbers))[0])
        place = f" at {', '.join(map(str, k))}" if k else ""
        raise ValueError(f"{where}: expected finite numbers, got {numbers[k]}{place}")
    return numbers


def times(where: str, value: object, first: float = -inf, last: float = inf) -> Array:
    """Return `value` as a non-empty array of increasing times [s] in [first, last]."""
    bounded = isfinite(first) or isfinite(last)
    what = "increasing times in [{:g}, {:g}] s" if bounded else "increasing times [s]"
    found = array(where, value, what=what.format(first, last))
    rising = found[1:] > found[:-1]
    if found.size and first <= found[0] and found[-1] <= last and rising.all():
        return found
    got = "none" if not found.size else f"{found[0]:g} ... {found[-1]:g} s"
    if not rising.all():
        k = int(np.argmin(rising))
        got = f"{found[k + 1]:g} after {found[k]:g} s"
    raise ValueError(f"{where}: expected {what.format(first, last)}, got {got}")


def path(where: str, value: object) -> Path:
    """Return `value` as the path of a file or folder; "~" is the home directory of the user."""
    name = fspath(value) if isinstance(value, str | PathLike) else None
    if not isinstance(name, str) or not name or "\0" in name:
        raise refused(where, "a path, such as 'run.csv'", value)
    found = Path(name)
    return found.expanduser() if found.parts[:1] == ("~",) else found


def function(where: str, value: object, what: str) -> Any:
    """Return `value`, which must be callable."""
    if callable(value) and not isinstance(value, type):
        return value
    raise refused(where, what, value)


def check_names(where: str, given: Iterable[str], known: Collection[str], hint: str = "") -> None:
    """Raise one error for all names that are not in `known`; it offers the closest known names.

    `hint` is the advice if no known name is close.
    """
    listed = list(given)
    if not listed:
        return
    odd = [name for name in listed if not isinstance(name, str)]  # pyright: ignore[reportUnnecessaryIsInstance]
    if odd:
        raise refused(where, _one_of(known), odd[0])
    unknown = [name for name in listed if name not in known]
    if not unknown:
        return
    text = Path(__file__).with_name("synonyms.txt").read_text("utf-8")
    same = [set(line.split()) for line in text.splitlines() if not line.startswith("#")]
    close = [
        [one for one in known if any({one, name} <= names for names in same)]
        or [one for one in known if one.endswith((f".{name}", f"_{name}"))]
        or [one for one in known if one.startswith(f"{name}_")]
        or get_close_matches(name, list(known), n=1, cutoff=0.4)
        for name in unknown
    ]
    offers = ", ".join(c[0] for c in close if c)
    advice = hint or ("check the spelling" if known else "")
    if offers:
        advice = f"did you mean {offers}?"
    got = ", ".join(_cut(name) for name in unknown)
    raise ValueError(
        f"{where}: expected {_one_of(known)}, got {got}" + f"; {advice}" * bool(advice)
    )


def _one_of(known: Collection[str]) -> str:
    if not known:
        return "no names"
    if len(known) > LISTED:
        return f"one of {len(known)} known names"
    return f"one of {', '.join(known)}"
