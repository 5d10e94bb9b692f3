"""Persistent identity of symbols in copies, pickles and files.

A CasADi symbol is an atom: two symbols of one name are different, and expressions depend on one of
them only. CasADi refuses to pickle symbols, since another process does not have them. Here a symbol
that leaves the process gets a unique name, and each reader of that name gets the same symbol: the
original one in the process where it was made, a single one in any other process, whatever object it
came in. A law and a model that were pickled separately therefore still share their parameter, and
`copy.deepcopy` does not copy symbols.

A name lasts as long as an object with it, or a copy, exists; nothing is kept for ever.

Importing this module makes `pickle` accept SX and MX, alone or inside other objects.
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
"""Attribute of a CasADi expression that keeps the names of its symbols alive."""


@final
@dataclass(frozen=True, eq=False)
class Atom:
    """Symbol and its unique name."""

    symbol: Any
    name: str


_lock = Lock()
_by_node: WeakValueDictionary[tuple[type, int], Atom] = WeakValueDictionary()
_by_name: WeakValueDictionary[tuple[type, str], Atom] = WeakValueDictionary()


def _node(symbol: Any) -> tuple[type, int]:
    """Return the address of the symbol, unique as long as an `Atom` holds it."""
    node = symbol.element_hash() if isinstance(symbol, ca.SX) else hash(symbol)
    return type(symbol), node


def _known(symbol: Any, name: str) -> Atom:
    """Return the atom of a name: the known one, else a new one of `symbol`."""
    found = _by_name.get((type(symbol), name))
    if found is None or found.symbol.name() != symbol.name():
        found = Atom(type(symbol)(symbol), name)
        _by_node[_node(symbol)] = _by_name[type(symbol), name] = found
    return found


def named(expressions: Sequence[Expression]) -> tuple[Atom, ...]:
    """Return the atoms in some expressions, which keep their names from now on."""
    atoms = list[Atom]()
    with _lock:
        flat: list[Any] = [ca.vec(e) for e in expressions if not e.is_constant()]
        for symbol in ca.symvar(ca.vertcat(*flat)) if flat else ():
            found = _by_node.get(_node(symbol))
            atoms.append(found or _known(symbol, uuid4().hex))
    keep(expressions, atoms)
    return tuple(atoms)


def atoms_of(labels: Sequence[str], names: Sequence[str]) -> list[Atom]:
    """Return the SX symbols of these unique names in this process, created if missing."""
    with _lock:
        return [_known(ca.SX.sym(label), name) for label, name in zip(labels, names, strict=True)]


def again(
    expression: Expression, symbols: Sequence[Expression], names: Sequence[str]
) -> Expression:
    """Return an expression that was read with its `symbols`, in those of this process with these
    names.
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
    """Keep the names of `atoms` as long as one of the expressions exists."""
    kept = tuple(atoms)
    for expression in expressions:
        vars(expression)[KEPT] = kept


def deserialized(text: str, names: Sequence[str] | None) -> Any:
    """Return the expression or Function that `serialized` wrote; CasADi may execute its content."""
    if names is None:
        return ca.Function.deserialize(text)
    reader: Any = ca.StringDeserializer(text)
    symbols = reader.unpack()
    return again(reader.unpack(), symbols, names)


def serialized(value: Any) -> tuple[str, tuple[str, ...] | None]:
    """Return an expression or Function in CasADi's own format, and the names of its symbols."""
    if isinstance(value, ca.Function):
        return str(value.serialize()), None
    atoms = named([value])
    writer: Any = ca.StringSerializer()
    writer.pack([atom.symbol for atom in atoms])
    writer.pack(value)
    return writer.encode(), tuple(atom.name for atom in atoms)


def _written(expression: Any) -> Any:
    """Reduce an expression for `pickle`; inside CasADi's own pickling as CasADi does."""
    if getattr(ca.casadi, "_current_pickle_context", lambda: None)():
        return object.__reduce_ex__(expression, 2)
    return deserialized, serialized(expression)


for _kind in (ca.SX, ca.MX):
    copyreg.pickle(_kind, _written)  # pyright: ignore[reportUnknownMemberType, reportArgumentType]
