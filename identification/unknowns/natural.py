"""Natural units of data: force, load, length and time in which measured numbers are of order one.

Defaults of a law are numbers for one machine. In natural units they suit any machine, so that the
result of a fit does not depend on the units of force, length and time.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from math import isfinite, prod
from re import sub
from typing import TypeVar, final

from identification.unknowns import roles
from identification.unknowns.spec import Draft, Unknown
from symfric.foundation.parameters import Parameter, Parametric, parameters, with_values
from symfric.foundation.units import parsed
from symfric.foundation.variable import POSITIVE

P = TypeVar("P", bound=Parametric)

PER_LOAD = ("level", "viscous", "stiffness", "damping")
"""Roles of parameters that multiply the normal force if their unit contains no force."""
SLIDING = (("N m", "N"), ("kg m^2", "kg"), ("rad", "m"))
"""Units of rotation and the corresponding units of sliding."""


@final
@dataclass(frozen=True)
class Natural:
    """Natural units of force, normal force, length and time, in SI units."""

    force: float = 1.0
    load: float = 1.0
    length: float = 1.0
    time: float = 1.0

    def size(self, parameter: Parameter, known: Mapping[str, Parameter]) -> float:
        """Return the natural unit of a parameter; letters in exponents are names in `known`."""
        text = sub(r"\^([a-z])\b", lambda m: f"^{float(known[m[1]].value):g}", parameter.unit)
        powers = _powers(text)
        if parameter.role == "load":
            return self.load ** powers.get("N", 0.0)
        shared = parameter.role in PER_LOAD and not {"N", "kg"} & powers.keys()
        return self.of_unit(text) * (self.force / self.load if shared else 1.0)

    def of_unit(self, unit: str) -> float:
        """Return the natural unit of a quantity other than a normal force."""
        units = {"N": self.force, "m": self.length, "s": self.time}
        units["kg"] = self.force * self.time**2 / self.length
        return prod(units.get(symbol, 1.0) ** power for symbol, power in _powers(unit).items())

    def sizes(self, whole: Parametric) -> dict[str, float]:
        """Return the natural units of all parameters; 1 if bounds of `whole` are in SI units."""
        known = parameters(whole)
        found = {name: self.size(p, known) for name, p in known.items()}
        bounds = [b for n, p in known.items() if found[n] != 1.0 for b in (p.lower, p.upper)]
        if any(isfinite(b) and not 0.0 <= b <= POSITIVE for b in bounds):
            return dict.fromkeys(found, 1.0)
        return found

    def rescaled(self, whole: P) -> P:
        """Return a law or a scene with its numbers in natural units."""
        sizes = self.sizes(whole)
        values = {n: float(p.value) / sizes[n] for n, p in parameters(whole).items()}
        return with_values(whole, values)


def of_parameter(parameter: Parameter, unit: str, speeds: roles.Speeds, size: float) -> Draft:
    """Return the draft of a parameter of a law or a scene according to its role.

    Its default is a number in its natural unit `size`.
    """
    value, logarithmic = float(parameter.value), roles.is_logarithmic(parameter)
    default = size * parameter.default
    if 0 < parameter.lower <= POSITIVE:
        parameter = replace(parameter, lower=0.0)
    start = default if value == parameter.default else value
    unknown = Unknown(
        parameter.name, unit, start, *roles.window(parameter, speeds),
        scale=abs(start) or abs(default) or size, logarithmic=logarithmic,
    )  # fmt: skip
    return Draft(unknown, parameter.lower, parameter.upper)


def _powers(unit: str) -> dict[str, float]:
    """Return the powers of the symbols in a unit, with those of sliding for rotation."""
    for turning, sliding in SLIDING:
        unit = unit.replace(turning, sliding)
    found = parsed(unit)
    return {} if found is None else dict(found.powers)
