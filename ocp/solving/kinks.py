"""Where a solve that failed meets friction that is smoothed over less than a step."""

from collections.abc import Iterator
from typing import Any

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from ocp.formulation.phase import Span
from ocp.transcription.transcription import Transcription
from ocp.transcription.unknowns import Points, SpanPoints
from symfric.foundation import checks
from symfric.foundation.parameters import parameters
from symfric.model.contact import Contact

Array = NDArray[np.float64]

NARROW = 0.02
"""A width below this share of the largest sliding velocity is one that Newton steps jump over."""
NAMED = 3
"""Contacts that a sentence names."""


def narrow_widths(transcription: Transcription, points: Points) -> str:
    """A sentence that names contacts with narrow widths; empty if there are none.

    Named are contacts that come to rest or turn round on the way, or whose widths smooth something
    else than their sliding velocity.
    """
    found: dict[str, str] = {}
    for span, at in zip(transcription.problem.spans, points.spans, strict=True):
        for contact in span.model.contacts:
            widths = list(_narrow(contact, span, at))
            if widths and contact.name not in found:
                found[contact.name] = f"contact '{contact.name}' has {' and '.join(widths)}"
    if not found:
        return ""
    names = checks.listed(list(found.values()), NAMED)
    return f"Friction is smoothed over a small width: {names}; raise it or use friction='auto'."


def _narrow(contact: Contact, span: Span, at: SpanPoints) -> Iterator[str]:
    """Widths of a contact that are small against how it moves, each with its number."""
    slip = _along(span, at, contact.slip)
    fastest = float(np.abs(slip).max(initial=0.0))
    turns = slip.size > 0 and bool(slip.min() <= 0.0 <= slip.max())
    law: Any = contact.law  # which is Parametric
    known = parameters(law)
    for name, exponent in law.widths.items():
        value = _number(known[name].value, span)
        width = value if exponent > 0 else 1.0 / value
        if turns and 0.0 < width < NARROW * fastest:
            unit = contact.unit(known[name].unit)
            yield f"{name} = {value:.3g} {unit}".removesuffix(" 1")
    for name, variable in contact.widths.items():
        yield f"{name} = {_number(variable.start, span):.3g} {variable.unit}"


def _number(value: Any, span: Span) -> float:
    """The number of a parameter of a law, which may be one of the model."""
    function = ca.Function("number", [span.model.vector("p")], [ca.SX(value)])
    return float(function(span.p))


def _along(span: Span, at: SpanPoints, expression: ca.SX) -> Array:
    """An expression at the collocation points, or at the nodes where there are none."""
    inner = at.inner.shape[1]
    x, n = (at.inner, inner) if inner else (at.nodes[:, :-1], at.u.shape[1])
    u = np.repeat(at.u, n // at.u.shape[1], axis=1)
    z = at.z if at.z.shape[1] == n else np.zeros((at.z.shape[0], n))
    p = np.tile(span.p[:, None], (1, n))
    function = ca.Function("along", span.symbols, [expression])
    return function.map(n)(np.zeros((1, n)), x, z, u, p).full().ravel()
