"""Symbols that stay themselves: in copies, in pickles and in files.

A symbol of CasADi is an atom, as a class or a name is: two of one name are two, and what is written
with one knows only that one. CasADi itself refuses to pickle it, since another process has no such
atom. Here a symbol that leaves the process is given a name that nobody else has, and whoever reads
the name gets the same symbol each time: the one it came from in the process where it was made, one
and the same in any other, whatever it came in. So a law and a model that were pickled apart still
share their parameter, and `copy.deepcopy` leaves symbols alone.

Names last as long as an object that travelled or a copy of it lives; nothing is kept for ever.

Importing this makes `pickle` take SX and MX, alone or inside of anything.
"""

import copyreg
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from threading import Lock
from typing import Any, TypeVar, final
from uuid import uuid4
from weakref import WeakValueDictionary

import casadi as ca

Expression = TypeVar("Expression", ca.SX, ca.MX)
KEPT = "_symfric_atoms"
"""Attribute of an expression of CasADi that keeps the names of its symbols alive."""


@final
@dataclass(frozen=True, eq=False)
class Atom:
    """A symbol and the name that nobody else has."""

    symbol: Any
    name: str


_lock = Lock()
_by_node: WeakValueDictionary[tuple[type, int], Atom] = WeakValueDictionary()
_by_name: WeakValueDictionary[tuple[type, str], Atom] = WeakValueDictionary()


def _node(symbol: Any) -> tuple[type, int]:
    """Where the symbol lies; nothing else does as long as an `Atom` holds it."""
    node = symbol.element_hash() if isinstance(symbol, ca.SX) else hash(symbol)
    return type(symbol), node


def _known(symbol: Any, name: str) -> Atom:
    """The atom of a name: the one that is known, else `symbol`."""
    found = _by_name.get((type(symbol), name))
    if found is None or found.symbol.name() != symbol.name():
        found = Atom(type(symbol)(symbol), name)
        _by_node[_node(symbol)] = _by_name[type(symbol), name] = found
    return found


def named(expressions: Sequence[Expression]) -> tuple[Atom, ...]:
    """The atoms in some expressions, which from now on keep their names."""
    atoms = list[Atom]()
    with _lock:
        for symbol in _symbols(expressions):
            found = _by_node.get(_node(symbol))
            atoms.append(found or _known(symbol, uuid4().hex))
    keep(expressions, atoms)
    return tuple(atoms)


def atoms_of(labels: Sequence[str], names: Sequence[str]) -> list[Atom]:
    """The SX symbols of these unique names in this process, made where there are none."""
    with _lock:
        return [_known(ca.SX.sym(label), name) for label, name in zip(labels, names, strict=True)]


def again(
    expressions: Sequence[Expression], symbols: Sequence[Expression], names: Sequence[str]
) -> list[Expression]:
    """Expressions that were read, in the symbols that have these names here.

    Args:
        expressions: in the `symbols` that came with them.
        symbols: theirs.
        names: of the symbols.
    """
    if not expressions:
        return []
    with _lock:
        atoms = [_known(symbol, name) for symbol, name in zip(symbols, names, strict=True)]
    pairs = [
        (s, a.symbol) for s, a in zip(symbols, atoms, strict=True) if _node(s) != _node(a.symbol)
    ]
    found = list(expressions)
    if pairs:
        old, new = map(list, zip(*pairs, strict=True))
        found = list(ca.substitute(found, old, new))  # pyright: ignore
    keep(found, atoms)
    return found


def _symbols(expressions: Sequence[Any]) -> Iterable[Any]:
    """All symbols, each once, in a fixed order."""
    flat = [ca.vec(e) for e in expressions if not e.is_constant()]
    return ca.symvar(ca.vertcat(*flat)) if flat else ()


def keep(expressions: Iterable[Any], atoms: Sequence[Atom]) -> None:
    """Keep the names of `atoms` as long as one of the expressions lives."""
    kept = tuple(atoms)
    for expression in expressions:
        vars(expression)[KEPT] = kept


def deserialized(text: str, names: Sequence[str] | None) -> Any:
    """The expression or Function that `serialized` wrote; CasADi may run what it finds there."""
    if names is None:
        return ca.Function.deserialize(text)
    reader: Any = ca.StringDeserializer(text)
    symbols = reader.unpack()
    return again([reader.unpack()], symbols, names)[0]


def serialized(value: Any) -> tuple[str, tuple[str, ...] | None]:
    """An expression or Function in CasADi's own format, and the names of its symbols."""
    if isinstance(value, ca.Function):
        return str(value.serialize()), None
    atoms = named([value])
    writer: Any = ca.StringSerializer()
    writer.pack([atom.symbol for atom in atoms])
    writer.pack(value)
    return writer.encode(), tuple(atom.name for atom in atoms)


def _written(expression: Any) -> Any:
    """How `pickle` writes an expression; in CasADi's own context as CasADi does."""
    if getattr(ca.casadi, "_current_pickle_context", lambda: None)():
        return object.__reduce_ex__(expression, 2)
    return deserialized, serialized(expression)


for _kind in (ca.SX, ca.MX):
    copyreg.pickle(_kind, _written)  # pyright: ignore[reportUnknownMemberType, reportArgumentType]
