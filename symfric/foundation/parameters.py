"""Parameters of laws and scenes, with value, unit, bounds and default, and their symbols.

A parametric object is a frozen dataclass whose numbers are declared with `param`. The value of a
field is a float, which is a constant in all expressions, or a CasADi symbol, which is available to
derivatives, identification and optimal control. Objects are nested: a scene contains a law, a sum
contains its terms.
"""

from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import Field, dataclass, field, fields, replace
from math import inf
from typing import TYPE_CHECKING, Any, ClassVar, Self, TypeVar, dataclass_transform

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from symfric.foundation import checks, units
from symfric.foundation.checks import check_names as check_names
from symfric.foundation.numeric import Scalar, is_casadi, is_number, is_symbolic
from symfric.foundation.shown import Shown, TextTable, figure_of
from symfric.foundation.variable import POSITIVE, take_si
from symfric.foundation.variable import Variable as Variable

if TYPE_CHECKING:
    from matplotlib.figure import Figure

ROLES = {
    "level": "a dry friction level: a coefficient, or a force or torque",
    "viscous": "resistance that grows with the velocity",
    "velocity scale": "a velocity over which friction changes, or its inverse",
    "stiffness": "force over deflection",
    "damping": "force over velocity of a spring, a bristle or a damper",
    "length": "a deflection or a path that friction remembers",
    "time": "how fast friction follows: lag, dwell, ageing",
    "shape": "an exponent, a sharpness or a share that bends a curve",
    "width": "a smoothing width, or what stands in for rest; small against the motion",
    "load": "a normal force, or a share of one",
    "temperature": "a temperature, or what it changes",
    "geometry": "a length or an angle of the machine",
    "mass": "mass, also per length",
    "inertia": "moment of inertia",
    "gravity": "acceleration of gravity",
    "offset": "a constant force besides friction",
    "motion": "what moves the machine: a start value, a given velocity or path",
    "sampling": "of random contacts: how many, and which random numbers",
}
"""Roles of parameters and their meaning; the role "" is unspecified."""


def param(
    default: float, *, unit: str, doc: str, role: str = "", width: int = 0,
    lower: float = -inf, upper: float = inf,
) -> Any:  # fmt: skip
    """Declare a parameter field of a `Parametric` dataclass.

    Args:
        default: default value.
        unit: SI unit, "1" for a pure number.
        doc: short description.
        role: purpose, one of `ROLES`, by which identification, temperature models and the code
            generator recognise parameters; "" if unspecified.
        width: for a parameter that smooths a jump, its exponent in the smoothing width: 1 for the
            width itself, -1 for a steepness; 0 for other parameters.
        lower, upper: closed bounds, which are also the bounds in identification; a lower bound
            in (0, `POSITIVE`] admits all positive numbers.

    Raises:
        ValueError: the role is unknown, or a bound or the width is no number.
    """
    if role and role not in ROLES:
        raise ValueError(f"param: role: expected one of {', '.join(ROLES)}, got {role!r}")
    unit = units.checked("param", unit, stacklevel=3)
    checks.count("param: width", width, least=-9, most=9)
    for name, bound in (("lower", lower), ("upper", upper)):
        if checks.as_number(bound) is None:
            raise checks.refused(f"param: {name}", "a number", bound)
    meta = {"unit": unit, "doc": doc, "role": role, "lower": lower, "upper": upper, "width": width}
    return field(default=default, metadata=meta)


def option(default: str, *, choices: tuple[str, ...], doc: str) -> Any:
    """Declare a field of a `Parametric` dataclass that selects one of several forms.

    The form is selected when the object is created; expressions contain no switch.
    """
    return field(default=default, metadata={"choices": choices, "doc": doc})


T = TypeVar("T")


@dataclass_transform(frozen_default=True, eq_default=False)
def parametric(cls: type[T]) -> type[T]:
    """Make a subclass of `Parametric` a frozen dataclass that is compared by identity."""
    return dataclass(frozen=True, eq=False)(cls)


@dataclass(frozen=True, eq=False)
class Parameter:
    """Parameter of an object, with its value and metadata.

    Attributes:
        name: flat name in the whole object, such as "mu_s_pos".
        field: name in the part that declares the parameter, such as "mu_s".
        role: purpose, one of `ROLES`, or "".
        width: exponent in the width of a smoothed jump, see `param`.
    """

    name: str
    value: Scalar
    unit: str
    default: float
    lower: float
    upper: float
    doc: str
    role: str = ""
    field: str = ""
    width: int = 0


@dataclass(frozen=True, eq=False)
class Parametric:
    """Frozen dataclass with `param` fields, whose values are checked on construction.

    Objects are compared by identity, because a comparison of symbols has no truth value.
    """

    ordered: ClassVar[tuple[tuple[str, str], ...]] = ()
    """Pairs of fields (a, b) that must satisfy a <= b."""

    strictly_ordered: ClassVar[tuple[tuple[str, str], ...]] = ()
    """Pairs of fields (a, b) that must satisfy a < b."""

    suffixes: ClassVar[tuple[str, ...]] = ()
    """Name suffixes of the children; if empty, parameters are renamed only to avoid duplicates."""

    def __new__(cls, *_: Any, **given: Any) -> Self:
        """Create an object; the error for an unknown field offers the nearest name."""
        if bare := [name for name, value in vars(cls).items() if isinstance(value, Field)]:
            what, got = f"@parametric above class {cls.__name__}", f"none for {', '.join(bare)}"
            raise ValueError(f"{cls.__name__}: expected the decorator {what}, got {got}")
        if not given.keys() <= cls.__dataclass_fields__.keys():
            check_names(cls.__name__, given, [item.name for item in fields(cls)])
        return super().__new__(cls)

    def __post_init__(self) -> None:
        declared = (item.name for item in fields(self) if "unit" in item.metadata)
        take_si(type(self).__name__, self, *declared)
        problems = list(_problems(self))
        if problems:
            raise ValueError(f"{type(self).__name__}: " + "; ".join(problems))

    def _repr_html_(self) -> str:
        """Return HTML for notebooks with a table of parameters and a figure."""
        rows = [(p.name, figure_of(p.value), p.unit, p.doc) for p in parameters(self).values()]
        rows += [(o.name, o.value, "", o.doc) for o in options(self).values()]
        first = (self.__doc__ or "").partition("\n")[0]
        table = TextTable(("parameter", "value", "unit", ""), tuple(rows), numbers=(1,))
        return Shown(type(self).__name__, (first,), table).html(self.thumbnail())

    def thumbnail(self) -> "Figure | None":
        """Return a small figure, or None."""


P = TypeVar("P", bound=Parametric)


def _problems(obj: Parametric) -> Iterator[str]:
    for item in fields(obj):
        value, meta = getattr(obj, item.name), item.metadata
        if "choices" in meta and value not in meta["choices"]:
            yield f"{item.name}: expected one of {', '.join(meta['choices'])}, got {value!r}"
        if "unit" not in meta or is_symbolic(value):
            continue
        numbers, unit, low, high = _numbers(value), meta["unit"], meta["lower"], meta["upper"]
        if not numbers.size or not np.isfinite(numbers).all():
            got = checks.shown(value)
            yield f"{item.name}: expected a finite number [{unit}] or a symbol, got {got}"
        elif not (inside := _reaches(low, numbers) & (numbers <= high)).all():
            beyond = numbers[~inside][0]
            yield (
                f"{item.name}: expected {low:g} <= {item.name} <= {high:g} [{unit}], got {beyond:g}"
            )
    for pairs, sign in ((obj.ordered, "<="), (obj.strictly_ordered, "<")):
        for low, high in pairs:
            a, b = getattr(obj, low), getattr(obj, high)
            first, last = _numbers(a), _numbers(b)
            fit = first.size == last.size or 1 in (first.size, last.size)
            if fit and (first > last if sign == "<=" else first >= last).any():
                shown = f"{low} = {_shown(a)} and {high} = {_shown(b)}"
                yield f"expected {low} {sign} {high}, got {shown}"


def _reaches(low: float, numbers: NDArray[np.float64]) -> NDArray[np.bool_]:
    """Return a mask of the numbers at or above a lower bound."""
    return numbers > 0 if 0 < low <= POSITIVE else numbers >= low


def _numbers(value: Any) -> NDArray[np.float64]:
    """Return a number, a numeric array or a constant matrix as a flat array; else an empty one."""
    if is_casadi(value) and not is_symbolic(value):
        return ca.DM(value).full().ravel()
    numeric = isinstance(value, np.ndarray) and value.dtype.kind in "iuf"
    return np.array(value, float).ravel() if numeric or is_number(value) else np.zeros(0)


def _shown(value: Scalar) -> str:
    return f"{value:g}" if is_number(value) else str(value)


def _children(obj: Parametric) -> list[tuple[str, int | None, Parametric]]:
    """Return nested parametric objects as (field, index in a tuple or None, child)."""
    found: list[tuple[str, int | None, Parametric]] = []
    for item in fields(obj):
        value = getattr(obj, item.name)
        if isinstance(value, Parametric):
            found.append((item.name, None, value))
        elif isinstance(value, tuple):
            found += [(item.name, i, v) for i, v in enumerate(value) if isinstance(v, Parametric)]
    return found


def _names(obj: Parametric) -> dict[str, tuple[int | None, str]]:
    """Return (child number or None, name in the child) of each parameter by its flat name."""
    own = [item.name for item in fields(obj) if "unit" in item.metadata]
    inner = [list(_names(child)) for _, _, child in _children(obj)]
    if obj.suffixes:
        flat = [[f"{n}_{s}" for n in c] for c, s in zip(inner, obj.suffixes, strict=True)]
    else:
        flat = distinct(inner, own)
    names: dict[str, tuple[int | None, str]] = {name: (None, name) for name in own}
    for i, (new, old) in enumerate(zip(flat, inner, strict=True)):
        names |= {n: (i, o) for n, o in zip(new, old, strict=True)}
    return names


def distinct(groups: Sequence[Sequence[str]], taken: Sequence[str] = ()) -> list[list[str]]:
    """Return the names of several groups; repeated names are made unique by the group number."""
    count = Counter([*taken, *(name for group in groups for name in group)])
    used = set(count)
    renamed: list[list[str]] = []
    for number, group in enumerate(groups, start=1):
        renamed.append([])
        for name in group:
            flat = name
            while count[name] > 1 and flat in used:
                flat = f"{flat}_{number}"
            used.add(flat)
            renamed[-1].append(flat)
    return renamed


def parameters(obj: Parametric) -> dict[str, Parameter]:
    """Return all parameters of `obj` and of its parts, by flat name.

    Names are the field names. Repeated names in the terms of a sum have the suffixes `_1`, `_2`,
    ...; the two sides of an asymmetric law have the suffixes `_pos` and `_neg`.

    Raises:
        ValueError: `obj` is neither a law nor a scene.
    """
    _check_parametric("parameters", obj)
    found: dict[str, Parameter] = {}
    children = [parameters(child) for _, _, child in _children(obj)]
    own = {item.name: item for item in fields(obj)}
    for flat, (child, name) in _names(obj).items():
        if child is None:
            known: dict[str, Any] = {"default": own[name].default, **own[name].metadata}
            found[flat] = Parameter(name=flat, value=getattr(obj, name), field=name, **known)
        else:
            found[flat] = replace(children[child][name], name=flat)
    return found


@dataclass(frozen=True)
class Option:
    """Option of an object, with its value and choices."""

    name: str
    value: str
    default: str
    choices: tuple[str, ...]
    doc: str


def options(obj: Parametric) -> dict[str, Option]:
    """Return the options of `obj` by name, without those of its parts."""
    found: dict[str, Option] = {}
    for item in fields(obj):
        if "choices" in item.metadata:
            known: dict[str, Any] = {"default": item.default, **item.metadata}
            found[item.name] = Option(name=item.name, value=getattr(obj, item.name), **known)
    return found


def with_values(obj: P, values: Mapping[str, Scalar]) -> P:
    """Return a copy of `obj` with the parameters in `values` replaced, at any level.

    Raises:
        ValueError: `obj` has no parameter of a name (the closest names are offered), or a value is
            out of bounds.
    """
    _check_parametric("with_values", obj)
    names = _names(obj)
    values = checks.named(type(obj).__name__, values, names)
    changes: dict[str, Any] = {}
    per_child: dict[int, dict[str, Scalar]] = {}
    for flat, value in values.items():
        child, name = names[flat]
        if child is None:
            changes[name] = value
        else:
            per_child.setdefault(child, {})[name] = value
    for number, (field_name, index, child) in enumerate(_children(obj)):
        if number not in per_child:
            continue
        new = with_values(child, per_child[number])
        if index is None:
            changes[field_name] = new
        else:
            items = list(changes.get(field_name, getattr(obj, field_name)))
            items[index] = new
            changes[field_name] = tuple(items)
    return replace(obj, **changes)


def symbolise(obj: P, *names: str) -> tuple[P, tuple[Variable, ...]]:
    """Return a copy of `obj` with SX symbols for the named parameters, and their variables.

    Other parameters remain constants, so that terms with a zero coefficient are omitted from
    expressions.

    Returns:
        The copy, and one `Variable` per name with start value, unit and bounds of the parameter.

    Raises:
        ValueError: a name is unknown or repeated.
    """
    known = parameters(obj)
    names = checks.names(type(obj).__name__, names, known)
    variables: list[Variable] = []
    for name in names:
        p = known[name]
        size = 1.0 if is_symbolic(p.value) else abs(float(p.value)) or 1.0
        variables.append(Variable(name, p.unit, p.value, size, p.lower, p.upper, p.doc))
    return with_values(obj, {v.name: v.symbol for v in variables}), tuple(variables)


def _check_parametric(where: str, obj: object) -> None:
    checks.kind(where, obj, Parametric, "a law or a scene, such as LuGre()")
