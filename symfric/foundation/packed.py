"""Frozen data with expressions in it as plain arrays: for files, and for pickles.

A pack is an archive of arrays (NPZ): one holds JSON, in which objects are named by class and
fields, one the expressions, as CasADi writes them, all together, with the names of their symbols
(`symfric.foundation.identity`); the others are arrays as they are. Nothing is run to read one:
classes of symfric get their fields, and those of others only if they are handed over. Numbers come
back to the bit.
"""

import json
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, fields, is_dataclass
from enum import Enum
from functools import partial
from importlib import import_module
from io import BytesIO
from types import BuiltinFunctionType, FunctionType
from typing import IO, Any, TypeVar, cast, final
from zipfile import BadZipFile

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from symfric.foundation import checks, identity

OWN = ("symfric", "ocp", "identification")
"""Packages whose classes are known."""
ABOUT, EXPRESSIONS = "about", "expressions"
CASADI = ca.SX | ca.MX | ca.DM | ca.Function
Bytes = NDArray[np.uint8]


@final
@dataclass(frozen=True, eq=False)
class Given:
    """A function without arguments that returns what it was given; a pack may hold it."""

    value: Any

    def __call__(self) -> Any:
        """It."""
        return self.value


T = TypeVar("T")


def shallow(thing: T) -> T:
    """Another object with the same fields."""
    made = object.__new__(type(thing))
    made.__dict__.update(vars(thing))
    return made


def dump(file: IO[bytes], thing: object, kind: str = "", form: int = 0) -> None:
    """Write the pack of `thing` to an open file.

    An object that has `to_pack()` says itself what its fields are in a pack; one that has
    `packed_as()` is packed as another object, whose `unpacked()` makes it again.

    Args:
        file: open for writing.
        thing: what is packed.
        kind: what the file calls itself.
        form: number of the format, raised whenever older programs would misread it.

    Raises:
        ValueError: something that no pack holds, such as a function, and where it is.
    """
    writer = _Writer()
    content = writer.write("", thing)
    expressions, symbols = writer.expressions()
    head = {"kind": kind, "format": form, "symbols": symbols, "content": content}
    arrays = {f"a{k}": array for k, array in enumerate(writer.arrays)}
    words = {ABOUT: json.dumps(head).encode(), EXPRESSIONS: expressions.encode()}
    plain = {name: np.frombuffer(text, np.uint8) for name, text in words.items()}
    np.savez(file, **plain, **arrays)  # pyright: ignore[reportArgumentType]


def dumps(thing: object) -> bytes:
    """The pack of `thing`."""
    buffer = BytesIO()
    dump(buffer, thing)
    return buffer.getvalue()


def load(
    file: IO[bytes], kind: str = "", form: int = 0,
    own: Iterable[type | Callable[..., Any]] = (), reader: str = "load_run",
) -> Any:  # fmt: skip
    """What `dump` wrote.

    Args:
        file: open for reading.
        kind, form: as they were given to `dump`; older formats are read, too.
        own: classes and functions in it that are not symfric's.
        reader: to whom users hand them over.

    Raises:
        ValueError: no pack of this kind, a damaged one, one of a newer format, or a class or
            function that is not known.
    """
    try:
        opened = np.load(file, allow_pickle=False)
        if not isinstance(opened, np.lib.npyio.NpzFile):
            raise _foreign
        with opened as archive:
            arrays = {name: archive[name] for name in archive.files}
        about = json.loads(arrays.pop(ABOUT).tobytes())
        if about["kind"] != kind:
            raise UnreadableError(f"expected a file of the kind '{kind}', got a '{about['kind']}'")
        if not 1 <= about["format"] <= form:
            raise UnreadableError(
                f"expected format {form} or older, got {about['format']}; it was written by a "
                "newer version of symfric, which reads it"
            )
        known = {_path(one): one for one in own}
        return _Reader(arrays, about.get("symbols"), known, reader).read(about["content"])
    except (BadZipFile, KeyError, IndexError, EOFError, OSError, TypeError) as error:
        raise _foreign from error
    except (ValueError, RuntimeError) as error:
        raise (error if isinstance(error, UnreadableError) else _foreign) from error


def loads(data: bytes) -> Any:
    """What `dumps` wrote, in a pickle: with classes of anybody."""
    arrays = dict(np.load(BytesIO(data), allow_pickle=False))
    about = json.loads(arrays[ABOUT].tobytes())
    return _Reader(arrays, about["symbols"], None).read(about["content"])


class UnreadableError(ValueError):
    """A pack of another version, or with a class that is neither symfric's nor handed over."""


_foreign = ValueError("expected a file that symfric wrote, got something else or a damaged one")


def _path(named: Any) -> str:
    return f"{named.__module__}:{named.__qualname__}"


def _found(path: str) -> Any:
    """What stands under this name in its module.

    Raises:
        ImportError, AttributeError, ValueError: there is none.
    """
    place, _, name = path.partition(":")
    found: Any = import_module(place)
    for part in name.split("."):
        found = getattr(found, part)
    return found


@final
class _Writer:
    """Turns objects into JSON; arrays and expressions are put aside."""

    def __init__(self) -> None:
        self.arrays: list[NDArray[Any]] = []
        self._expressions: list[Any] = []
        self._known: dict[int, int] = {}
        self._alive: list[object] = []

    def expressions(self) -> tuple[str, list[list[str]]]:
        """All expressions behind their symbols, as CasADi writes them; the names of the symbols."""
        stream: Any = ca.StringSerializer()
        names = list[list[str]]()
        for kind in (ca.SX, ca.MX):
            those: list[Any] = [e for e in self._expressions if isinstance(e, kind)]
            atoms = identity.named(those)
            stream.pack([atom.symbol for atom in atoms] or [kind(0)])
            names.append([atom.name for atom in atoms])
        stream.pack(len(self._expressions))
        for expression in self._expressions:
            stream.pack(expression)
        return stream.encode(), names

    def write(self, where: str, value: Any) -> Any:
        """`value` as JSON; what has more than a text or a number is {kind: content}."""
        if value is None or isinstance(value, bool | str | int):
            return value
        if isinstance(value, float | np.floating | np.integer | np.bool_):
            return value.item() if isinstance(value, np.generic) else value
        if isinstance(value, CASADI):
            self._expressions.append(value)
            return {"casadi": len(self._expressions) - 1}
        if isinstance(value, np.ndarray):
            return self._array(where, cast(NDArray[Any], value))
        if isinstance(value, Enum):
            return {"enum": [_path(type(value)), value.name]}
        if isinstance(value, tuple | list):
            several = [self.write(f"{where}[{i}]", v) for i, v in enumerate(value)]  # pyright: ignore
            return {type(value).__name__: several} if type(value) is tuple else several
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

    def _function(self, where: str, value: Any) -> Any:
        """A function of Python, by where it stands."""
        try:
            same = _found(_path(value)) is value
        except (ImportError, AttributeError, ValueError):
            same = False
        if same:
            return {"function": _path(value)}
        what = "a function that can be imported: written by def at the top of a module"
        hint = "move it there (arguments by functools.partial), or write a casadi.Function"
        raise checks.refused(f"pack{where}", what, value, hint)

    def _array(self, where: str, value: NDArray[Any]) -> Any:
        if value.dtype.kind not in "biufU":
            raise checks.refused(f"pack{where}", "an array of numbers", value)
        self.arrays.append(value)
        return {"array": len(self.arrays) - 1}

    def _object(self, where: str, value: Any) -> Any:
        """An object by class and fields, once; "same" where it stands again."""
        if id(value) in self._known:
            return {"same": self._known[id(value)]}
        kind = type(value)
        if hasattr(kind, "packed_as") and not isinstance(value, type):
            return {"was": self.write(where, value.packed_as())}
        if isinstance(value, type) or not (is_dataclass(kind) or hasattr(kind, "to_pack")):
            what = "numbers, texts, expressions and objects made of them"
            raise checks.refused(f"pack{where}", what, value)
        self._known[id(value)] = len(self._known)
        self._alive.append(value)
        say: Callable[[], dict[str, Any]] = getattr(value, "to_pack", partial(state_of, value))
        state = say()
        has = {name: self.write(f"{where}.{name}", held) for name, held in state.items()}
        return {"is": _path(kind), "has": has}


def state_of(thing: Any) -> dict[str, Any]:
    """The fields of a dataclass."""
    return {item.name: getattr(thing, item.name) for item in fields(thing)}


@final
class _Reader:
    """Makes objects of JSON; `own` None lets classes and functions of anybody in."""

    def __init__(
        self,
        arrays: Mapping[str, NDArray[Any]],
        symbols: list[list[str]] | None,
        own: Mapping[str, Any] | None,
        reader: str = "",
    ) -> None:
        self._arrays, self._own, self._reader = arrays, own, reader
        stream: Any = ca.StringDeserializer(arrays[EXPRESSIONS].tobytes().decode())
        expressions = None if symbols is None else _expressions(stream, symbols)
        self._known: list[object] = []
        self._ways: dict[str, Callable[[Any], Any]] = {
            "casadi": lambda k: stream.unpack() if expressions is None else expressions[k],
            "array": lambda k: self._arrays[f"a{k}"],
            "enum": lambda named: getattr(self._class(named[0], Enum), named[1]),
            "tuple": lambda several: tuple(map(self.read, several)),
            "dict": lambda pairs: {self.read(name): self.read(value) for name, value in pairs},
            "same": lambda k: self._known[k],
            "was": lambda content: self.read(content).unpacked(),
            "function": self._function,
            "partial": lambda parts: self._partial(*map(self.read, parts)),
        }

    def read(self, value: Any) -> Any:
        """The object that was written as `value`."""
        if isinstance(value, list):
            return [self.read(one) for one in value]  # pyright: ignore[reportUnknownVariableType]
        if not isinstance(value, dict):
            return value
        if "is" in value:
            return self._object(self._class(value["is"], object), value["has"])  # pyright: ignore
        ((way, content),) = value.items()  # pyright: ignore[reportUnknownVariableType]
        return self._ways[cast(str, way)](content)

    def _object(self, kind: type, has: Mapping[str, Any]) -> Any:
        made = object.__new__(kind)
        self._known.append(made)
        vars(made).update({name: self.read(held) for name, held in has.items()})
        return made

    def _class(self, path: str, wanted: type) -> type:
        """The class of this name, if it is one that may be in a pack."""
        found = self._named(path, "classes")
        if self._own is not None and path in self._own:
            return found
        if not (isinstance(found, type) and issubclass(found, wanted)):
            raise _foreign
        if not (is_dataclass(found) or hasattr(found, "to_pack") or issubclass(found, Enum)):
            raise _foreign
        return cast(type, found)

    def _function(self, path: str) -> Any:
        """The function of this name; out of a file only one that was handed over."""
        if self._own is not None and path not in self._own:
            raise self._unknown("functions", path)
        return self._named(path, "functions")

    def _partial(self, function: Any, args: tuple[Any, ...], keywords: dict[str, Any]) -> Any:
        return partial(function, *args, **keywords)

    def _named(self, path: str, what: str) -> Any:
        """What has this name, handed over or of a known package."""
        place, _, name = path.partition(":")
        if self._own is not None and path in self._own:
            return self._own[path]
        if self._own is not None and place.split(".")[0] not in OWN:
            raise self._unknown(what, path)
        try:
            return _found(path)
        except (ImportError, AttributeError) as error:
            raise UnreadableError(
                f"expected {what} that this version of symfric has, got {name} of {place}; it was "
                "written by another one"
            ) from error

    def _unknown(self, what: str, path: str) -> UnreadableError:
        place, _, name = path.partition(":")
        return UnreadableError(
            f"expected {what} of symfric, got {name} of {place}; hand it over, as in "
            f"{self._reader}(path, own=[{name}])"
        )


def _expressions(stream: Any, names: list[list[str]]) -> list[Any]:
    """All expressions, in the symbols of this process."""
    symbols = [stream.unpack() for _ in names]
    found = [stream.unpack() for _ in range(stream.unpack())]
    for kind, known, own in zip((ca.SX, ca.MX), symbols, names, strict=True):
        places = [i for i, one in enumerate(found) if isinstance(one, kind)]
        if len(set(own)) != len(own):
            raise _foreign
        here = identity.again([found[i] for i in places], known if own else [], own)
        for i, one in zip(places, here, strict=True):
            found[i] = one
    return found
