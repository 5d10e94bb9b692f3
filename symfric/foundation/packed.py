"""Objects with CasADi expressions as plain arrays, for files and pickles.

A pack is an archive of arrays (NPZ). One array contains JSON, in which objects are represented by
class and fields, and arrays and expressions by number; the other arrays contain the data. Numbers
are restored exactly.

A file cannot run code. Expressions are lists of instructions (`symfric.foundation.instructions`),
arrays are never pickles, and objects are instances of the classes in a fixed list
(`symfric.foundation.storable`) or of classes passed by the caller; their fields are checked against
the annotations. A pickle is trusted, as all pickles are: it may also contain other classes and
expressions in the format of CasADi.
"""

import json
from collections.abc import Callable, Iterable, Mapping
from contextlib import suppress
from dataclasses import dataclass, fields, is_dataclass
from enum import Enum
from functools import partial
from io import BytesIO
from types import BuiltinFunctionType, FunctionType
from typing import IO, Any, Self, cast, final

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from symfric.foundation import checks, identity, storable
from symfric.foundation.instructions import Instructions

FUNCTION = tuple[str, list[ca.SX], list[ca.SX], list[str], list[str]]
"""Function in a file: its name, arguments, results, and the names of arguments and results."""
ABOUT, OLD = "about", "expressions"


@final
@dataclass(frozen=True, eq=False)
class Given:
    """Function without arguments that returns a stored value; packs may contain it."""

    value: Any

    def __call__(self) -> Any:
        """Return the stored value."""
        return self.value


class Portable:
    """Base of objects whose copies and pickles keep the identity of their symbols."""

    def __copy__(self) -> Self:
        """Return another object with the same fields and symbols."""
        made = object.__new__(type(self))
        vars(made).update(vars(self))
        return made

    def __reduce__(self) -> tuple[Any, ...]:
        """Return the pack for `pickle`."""
        return loads, (dumps(self),)


def dump(file: IO[bytes], thing: object, kind: str = "", form: int = 0) -> None:
    """Write the pack of `thing` to an open file.

    The method `to_pack()` of a class defines the fields in a pack. An object with `packed_as()` is
    replaced by the object that this method returns, whose `unpacked()` restores the original.

    Args:
        file: file that is open for writing.
        thing: object to pack.
        kind: name of the file type.
        form: version of the format; it is increased if older programs would misread the file.

    Raises:
        ValueError: a file cannot contain some part of the object, such as a function; the message
            names the part.
    """
    _Writer(trusted=False).pack(file, thing, kind, form)


def dumps(thing: object) -> bytes:
    """Return the pack of `thing` for a pickle."""
    buffer = BytesIO()
    _Writer(trusted=True).pack(buffer, thing, "", 0)
    return buffer.getvalue()


def holds(thing: object) -> bool:
    """Return True if a file can contain `thing`."""
    try:
        dump(BytesIO(), thing)
    except ValueError:
        return False
    return True


def load(
    file: IO[bytes], kind: str = "", form: int = 0,
    own: Iterable[type | Callable[..., Any]] = (), reader: str = "load_run",
) -> Any:  # fmt: skip
    """Return the object that `dump` wrote.

    Args:
        file: file that is open for reading.
        kind, form: values passed to `dump`; older formats are also read.
        own: classes and functions in the file that symfric does not define.
        reader: public function with the argument `own`, for messages.

    Raises:
        ValueError: the file is not a pack of this kind, is damaged, has a newer format, or contains
            an unknown class or function.
    """
    try:
        arrays = storable.arrays(file)
        if OLD in arrays:
            raise UnreadableError(
                "expected a current file, got one of an older format, which could run code; repeat "
                "the computation, or export JSON or CSV with the version that wrote the file"
            )
        about = json.loads(arrays.pop(ABOUT).tobytes())
        if about["kind"] != kind:
            raise UnreadableError(
                f"expected a file of the kind '{kind}', got a {checks.shown(about['kind'])}"
            )
        if not 1 <= about["format"] <= form:
            raise UnreadableError(
                f"expected format {form} or older, got {checks.shown(about['format'])}; it was "
                "written by a newer version of symfric; use that version"
            )
        known = {storable.path_of(one): one for one in own}
        return _Reader(arrays, known, reader).unpack(about)
    except UnreadableError:
        raise
    except Exception as error:  # zipfile, NumPy and CasADi raise various errors for damaged files
        raise _foreign() from error


def loads(data: bytes) -> Any:
    """Return the object that `dumps` packed; any classes are accepted."""
    arrays = storable.arrays(BytesIO(data))
    return _Reader(arrays, None).unpack(json.loads(arrays.pop(ABOUT).tobytes()))


class UnreadableError(ValueError):
    """Error for a pack of another version, or with a class that is not known."""


def _foreign() -> ValueError:
    return ValueError("expected a file that symfric wrote, got something else or a damaged one")


@final
class _Writer:
    """Converter of objects to JSON; arrays and expressions are collected separately.

    In a pickle, which is `trusted`, MX expressions and Functions have the format of CasADi.
    """

    def __init__(self, trusted: bool) -> None:
        self._arrays: list[NDArray[Any]] = []
        self._expressions: list[ca.SX] = []
        self._known: dict[int, tuple[int, object]] = {}
        self._trusted = trusted

    def pack(self, file: IO[bytes], thing: object, kind: str, form: int) -> None:
        """Write the archive of `thing` to `file`."""
        head: dict[str, Any] = {"kind": kind, "format": form, "content": self.write("", thing)}
        try:
            instructions = Instructions.of(self._expressions)
            if not self._trusted:
                instructions.check()
        except ValueError as error:
            if not self._trusted:
                raise ValueError(f"pack: {error}") from None
            head["serialized"] = [identity.serialized(e) for e in self._expressions]
            instructions = Instructions.of(())
        head["expressions"] = self.write("", instructions)
        about = np.frombuffer(json.dumps(head).encode(), np.uint8)
        arrays = {f"a{k}": array for k, array in enumerate(self._arrays)}
        np.savez(file, **{ABOUT: about}, **arrays)  # pyright: ignore[reportArgumentType]

    def write(self, where: str, value: Any) -> Any:
        """Return `value` as JSON; types unknown to JSON become {kind: content}."""
        if value is None or isinstance(value, bool | str | int):
            return value
        if isinstance(value, float | np.floating | np.integer | np.bool_):
            return value.item() if isinstance(value, np.generic) else value
        if isinstance(value, ca.SX | ca.DM):
            self._expressions.append(value if isinstance(value, ca.SX) else ca.SX(value))
            return {"DM" if isinstance(value, ca.DM) else "SX": len(self._expressions) - 1}
        if isinstance(value, ca.MX | ca.Function):
            return self._of_casadi(where, value)
        if isinstance(value, np.ndarray):
            array = cast(NDArray[Any], value)
            if array.dtype.kind not in storable.ARRAYS:
                raise checks.refused(f"pack{where}", "an array of numbers", array)
            self._arrays.append(array)
            return {"array": len(self._arrays) - 1}
        if isinstance(value, Enum):
            return {"enum": [storable.path_of(type(value)), value.name]}
        if isinstance(value, tuple | list):
            several = [self.write(f"{where}[{i}]", v) for i, v in enumerate(value)]  # pyright: ignore
            return {"tuple": several} if type(value) is tuple else several
        if isinstance(value, Mapping):
            pairs = cast(Mapping[Any, Any], value).items()
            return {
                "dict": [[self.write(where, k), self.write(f"{where}[{k!r}]", v)] for k, v in pairs]
            }
        if isinstance(value, FunctionType | BuiltinFunctionType):
            return self._function(where, value)
        if isinstance(value, partial):
            held: tuple[Any, ...] = (value.func, value.args, value.keywords)
            return {"partial": [self.write(where, part) for part in held]}
        return self._object(where, value)

    def _of_casadi(self, where: str, value: Any) -> Any:
        """Return a Function as expressions of its arguments; in a pickle, in CasADi's format."""
        if self._trusted:
            return {"serialized": identity.serialized(value)}
        if isinstance(value, ca.Function):
            arguments = value.sx_in()
            with suppress(RuntimeError, ValueError):
                Instructions.of(results := value.call(arguments))
                parts = [value.name(), arguments, results, value.name_in(), value.name_out()]
                return {"Function": self.write(where, parts)}
        what = "expressions in SX, and Functions that expand to SX"
        raise checks.refused(f"pack{where}", what, value)

    def _function(self, where: str, value: Any) -> Any:
        """Return a Python function as its import path."""
        if storable.importable(value):
            return {"function": storable.path_of(value)}
        what = "a function that can be imported: written by def at the top of a module"
        hint = "move it there (arguments by functools.partial), or write a casadi.Function"
        raise checks.refused(f"pack{where}", what, value, hint)

    def _object(self, where: str, value: Any) -> Any:
        """Return an object as class and fields, or as a reference "same" if it is repeated."""
        if id(value) in self._known:
            return {"same": self._known[id(value)][0]}
        kind = type(value)
        if hasattr(kind, "packed_as") and not isinstance(value, type):
            return {"was": self.write(where, value.packed_as())}
        known = self._trusted or storable.may_hold(storable.path_of(kind))
        data = is_dataclass(kind) or hasattr(kind, "to_pack")
        if isinstance(value, type) or not data or not known:
            what = "numbers, texts, expressions and objects made of them"
            raise checks.refused(f"pack{where}", what, value)
        if self._trusted and not storable.importable(kind):
            what = "an object whose class can be imported: defined at the top of a module"
            raise checks.refused(f"pack{where}", what, value, "move the class there")
        # keep the object, so that no other object gets its id
        self._known[id(value)] = len(self._known), value
        say: Callable[[], dict[str, Any]] = getattr(value, "to_pack", partial(state_of, value))
        state = say()
        has = {name: self.write(f"{where}.{name}", held) for name, held in state.items()}
        return {"is": storable.path_of(kind), "has": has}


def state_of(thing: Any) -> dict[str, Any]:
    """Return the fields of a dataclass."""
    return {item.name: getattr(thing, item.name) for item in fields(thing)}


@final
class _Reader:
    """Constructor of objects from JSON.

    `own` is None for a pickle, in which any classes and functions are allowed.
    """

    def __init__(
        self, arrays: Mapping[str, NDArray[Any]], own: Mapping[str, Any] | None, reader: str = ""
    ) -> None:
        self._arrays, self._own, self._reader = arrays, own, reader
        self._expressions: list[Any] = []
        self._known: list[object] = []
        read = self.read
        self._ways: dict[str, Callable[[Any], Any]] = {
            "SX": lambda k: self._expressions[k],
            "DM": lambda k: ca.DM(self._expressions[k]),
            "Function": lambda parts: self._of_expressions(read(parts)),
            "serialized": self._serialized,
            "array": lambda k: self._arrays[f"a{k}"],
            "enum": lambda named: self._class(named[0], Enum)[named[1]],
            "tuple": lambda several: tuple(map(read, several)),
            "dict": lambda pairs: {read(name): read(value) for name, value in pairs},
            "same": self._same,
            "was": lambda content: read(content).unpacked(),
            "function": self._function,
            "partial": lambda parts: partial(read(parts[0]), *read(parts[1]), **read(parts[2])),
        }

    def unpack(self, about: Mapping[str, Any]) -> Any:
        """Return the packed object."""
        instructions = checks.kind("pack", self.read(about["expressions"]), Instructions, "")
        self._expressions = instructions.expressions(trusted=self._own is None)
        self._expressions += map(self._serialized, about.get("serialized", ()))
        self._known.clear()
        return self.read(about["content"])

    def read(self, value: Any) -> Any:
        """Return the object that was written as `value`."""
        if isinstance(value, list):
            return [self.read(one) for one in value]  # pyright: ignore[reportUnknownVariableType]
        if not isinstance(value, dict):
            return value
        if "is" in value:
            return self._object(self._class(value["is"], object), value["has"])  # pyright: ignore
        ((way, content),) = value.items()  # pyright: ignore[reportUnknownVariableType]
        return self._ways[cast(str, way)](content)

    def _object(self, kind: type, has: Mapping[str, Any]) -> Any:
        """Return an object with the given fields; for a file, the class checks them."""
        made, k = object.__new__(kind), len(self._known)
        self._known.append(None)
        values = {name: self.read(held) for name, held in has.items()}
        if self._own is not None and storable.path_of(kind).startswith(storable.OURS):
            values = storable.checked(kind, values)
        vars(made).update(values)
        self._known[k] = made
        check: Any = getattr(made, "check_fields", getattr(made, "__post_init__", None))
        if self._own is not None and getattr(check, "__module__", "").startswith(storable.OURS):
            check()
        return made

    def _same(self, k: int) -> object:
        """Return object number `k`, which must be complete."""
        if self._known[k] is None:
            raise _foreign()
        return self._known[k]

    def _class(self, path: str, wanted: type) -> Any:
        """Return the class with this path, if packs may contain it."""
        path = storable.current(path)
        if self._own is not None and not storable.may_hold(path):
            raise _foreign()
        found = self._named(path, "classes")
        good = isinstance(found, type) and issubclass(found, wanted)
        data = is_dataclass(found) or hasattr(found, "to_pack") or wanted is Enum
        if not good or not data or storable.path_of(found) != path:
            raise _foreign()
        return found

    def _of_expressions(self, parts: Any) -> ca.Function:
        """Return a Function of SX expressions, without options of CasADi that could run code."""
        if not storable.fits(tuple(parts), FUNCTION):
            raise _foreign()
        return ca.Function(*parts)

    def _serialized(self, content: Any) -> Any:
        """Return an expression or Function from the format of CasADi, which may run code."""
        if self._own is not None:
            raise _foreign()
        return identity.deserialized(*content)

    def _function(self, path: str) -> Any:
        """Return the function with this path; for a file, the caller must have passed it."""
        if self._own is not None and path not in self._own:
            raise self._unknown("functions", path)
        return self._named(path, "functions")

    def _named(self, path: str, what: str) -> Any:
        """Return the object with this path, from the caller or from a known package."""
        module, _, name = path.partition(":")
        if self._own is not None and path in self._own:
            return self._own[path]
        if self._own is not None and module.split(".")[0] not in storable.OWN:
            raise self._unknown(what, path)
        try:
            return storable.found_at(path)
        except (ImportError, AttributeError) as error:
            raise UnreadableError(
                f"expected {what} that this version of symfric has, got {name} of {module}; it was "
                "written by another version"
            ) from error

    def _unknown(self, what: str, path: str) -> UnreadableError:
        module, _, name = path.partition(":")
        return UnreadableError(
            f"expected {what} of symfric, got {name} of {module}; pass it, as in "
            f"{self._reader}(path, own=[{name}])"
        )
