"""Forms of inputs over time: constant, linear or cubic on intervals, or a polynomial per phase."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal, final

from symfric.foundation import checks

MOST = 9
"""Largest degree of a polynomial."""


@final
@dataclass(frozen=True)
class Polynomial:
    """Input that is one polynomial of time over each phase, with free coefficients.

    Limits: high degrees are badly conditioned.

    Raises:
        ValueError: degree is not in 0 ... 9.
    """

    degree: int

    def __post_init__(self) -> None:
        degree = checks.count("Polynomial: degree", self.degree, least=0, most=MOST)
        object.__setattr__(self, "degree", degree)


Form = Literal["constant", "linear", "cubic"] | Polynomial
"""Form of an input.

    "constant"     constant on each interval of the mesh (default)
    "linear"       continuous, linear on each interval: the rate is constant there
    "cubic"        cubic spline with continuous first and second derivatives: the third derivative
                   is constant on each interval
    Polynomial(d)  polynomial of degree d over each phase, which may jump between phases
"""
Forms = Mapping[str, Form]

ORDERS: dict[str, int] = {"constant": 0, "linear": 1, "cubic": 3}
"""Form -> number of the derivatives that are states or inputs of the model."""
FORM = "'constant', 'linear', 'cubic' or Polynomial(degree)"


def is_form(form: object) -> bool:
    """Return True for one of the forms."""
    return isinstance(form, Polynomial) or (isinstance(form, str) and form in ORDERS)


def order_of(form: Form) -> int:
    """Return the number of derivatives of an input that the model needs."""
    return form.degree if isinstance(form, Polynomial) else ORDERS[form]


def rate_name(name: str, order: int = 1) -> str:
    """Return the name of a derivative of an input: "force_rate", "force_rate_rate", ..."""
    return name + order * "_rate"


def states_of(forms: Forms) -> tuple[str, ...]:
    """Return the inputs and derivatives of inputs that become states."""
    return tuple(
        rate_name(name, k)
        for name, form in forms.items()
        for k in range(order_of(form) + isinstance(form, Polynomial))
    )
