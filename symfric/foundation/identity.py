"""Persistent identity of symbols in copies, pickles and files.

Two CasADi symbols with the same name are different, and an expression depends on one of them only.
CasADi refuses to pickle symbols, because another process does not have them. In symfric, a symbol
that is pickled or saved gets a unique name, and reading this name always returns the same symbol:
the original in the process that created it, and one common symbol in any other process. A law and a
model that were pickled separately therefore still share their parameters, and `copy.deepcopy` does
not copy symbols.

A unique name is kept as long as an expression with its symbol, or a copy of it, exists.

Importing this module makes `pickle` accept SX and MX, also inside other objects.
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
"""Attribute of a CasADi expression that holds references to the atoms of its symbols."""


@final
@dataclass(frozen=True, eq=False)
class Atom:
    """Symbol with its unique name."""

    symbol: Any
    name: str


_lock = Lock()
_by_node: WeakValueDictionary[tuple[type, int], Atom] = WeakValueDictionary()
_by_name: WeakValueDictionary[tuple[type, str], Atom] = WeakValueDictionary()


def _node(symbol: Any) -> tuple[type, int]:
    """Return type and address of a symbol, which are unique while an `Atom` holds the symbol."""
    node = symbol.element_hash() if isinstance(symbol, ca.SX) else hash(symbol)
    return type(symbol), node


def _known(symbol: Any, name: str) -> Atom:
    """Return the atom with this name; if there is none, create it for `symbol`."""
    found = _by_name.get((type(symbol), name))
    if found is None or found.symbol.name() != symbol.name():
        found = Atom(type(symbol)(symbol), name)
        _by_node[_node(symbol)] = _by_name[type(symbol), name] = found
    return found


def named(expressions: Sequence[Expression]) -> tuple[Atom, ...]:
    """Return the atoms of the symbols in some expressions, and keep them with the expressions."""
    atoms = list[Atom]()
    with _lock:
        flat: list[Any] = [ca.vec(e) for e in expressions if not e.is_constant()]
        for symbol in ca.symvar(ca.vertcat(*flat)) if flat else ():
            found = _by_node.get(_node(symbol))
            atoms.append(found or _known(symbol, uuid4().hex))
    keep(expressions, atoms)
    return tuple(atoms)


def atoms_of(labels: Sequence[str], names: Sequence[str]) -> list[Atom]:
    """Return the atoms with these unique names in this process; create missing ones."""
    with _lock:
        return [_known(ca.SX.sym(label), name) for label, name in zip(labels, names, strict=True)]


def again(
    expression: Expression, symbols: Sequence[Expression], names: Sequence[str]
) -> Expression:
    """Return an expression with `symbols` replaced by the symbols of this process.

    Args:
        expression: expression that was read.
        symbols: its symbols, which were read with it.
        names: unique names of the symbols.
    """
    with _lock:
        atoms = [_known(symbol, name) for symbol, name in zip(symbols, names, strict=True)]
    pairs = zip(symbols, (atom.symbol for atom in atoms), strict=True)
    moved = [(old, new) for old, new in pairs if _node(old) != _node(new)]
    if moved:
        old, new = map(list, zip(*moved, strict=True))
        (expression,) = ca.substitute([expression], old, new)  # pyright: ignore
    keep([expression], atoms)
    return expression


def keep(expressions: Iterable[Any], atoms: Sequence[Atom]) -> None:
    """Keep `atoms` as long as one of the expressions exists."""
    kept = tuple(atoms)
    for expression in expressions:
        vars(expression)[KEPT] = kept


def deserialized(text: str, names: Sequence[str] | None) -> Any:
    """Return the expression or Function that `serialized` wrote; this may execute code."""
    if names is None:
        return ca.Function.deserialize(text)
    reader: Any = ca.StringDeserializer(text)
    symbols = reader.unpack()
    return again(reader.unpack(), symbols, names)


def serialized(value: Any) -> tuple[str, tuple[str, ...] | None]:
    """Return an expression or Function in the format of CasADi, and the names of its symbols."""
    if isinstance(value, ca.Function):
        return str(value.serialize()), None
    atoms = named([value])
    writer: Any = ca.StringSerializer()
    writer.pack([atom.symbol for atom in atoms])
    writer.pack(value)
    return writer.encode(), tuple(atom.name for atom in atoms)


def _written(expression: Any) -> Any:
    """Reduce an expression for `pickle`; within a pickle context of CasADi, as CasADi does."""
    if getattr(ca.casadi, "_current_pickle_context", lambda: None)():
        return object.__reduce_ex__(expression, 2)
    return deserialized, serialized(expression)


for _kind in (ca.SX, ca.MX):
    copyreg.pickle(_kind, _written)  # pyright: ignore[reportUnknownMemberType, reportArgumentType]
