"""Isotropic laws for slip in a plane or in space."""

from collections.abc import Mapping, Sequence
from dataclasses import fields as fields_of
from dataclasses import replace
from typing import ClassVar

import casadi as ca

from symfric.foundation.numeric import Scalar, column, empty
from symfric.foundation.parameters import Parametric, parametric
from symfric.foundation.vector import NotIsotropicError, Vector, Vectors
from symfric.laws.base import fields
from symfric.laws.base.law import Input, Law, State, Switch, chosen, require_law
from symfric.laws.composed.compose import Asymmetric, Sum
from symfric.laws.composed.wrap import Lagged


@parametric
class Isotropic(Parametric):
    """Friction law for slip v in two or three dimensions d.

        F = F(w, N)/w v,   w = sqrt(v'v + v_eps^2)      laws without states
        F = F(v, N, z),    dz/dt = rate(v, N, z)        laws with states, v and z vectors

    Quantities that change sign with the motion, such as v and deflections, become vectors. All
    others, such as an age or a level, remain numbers. The expressions of the law are evaluated with
    vectors: |a| is a magnitude, a/|a| a sign and a'b a product, see `symfric.foundation.vector`. An
    element that yields reduces only the component of slip along its load (radial return, rounded
    over `turn`). Therefore Maxwell-slip, Bouc-Wen and elasto-plastic elements agree with plasticity
    in the plane, and LuGre, Dahl and Gonthier with their published vector forms. Further inputs,
    such as F_e, are vectors (d, 1). The rows of z are the vector states along x, then along y, then
    along z, then the states that are numbers.
    Limits: the law itself for slip along a line; equivariant under rotations. Every vector state
    satisfies the bound that it has in straight slip. v_eps applies to laws without states only;
    laws with states have their own smoothing velocity.

    Raises:
        ValueError: the law distinguishes forward from backward, has modes (which change where v
            passes through zero), or contains expressions that are undefined for vectors.
    """

    axes: ClassVar[str] = ""
    """Names of the d axes, one letter each."""

    law: Law
    v_eps: Scalar = fields.REST_EPS(1e-9, doc="smoothing of the speed", lower=1e-15)
    turn: Scalar = fields.WIDTH(1e-2, doc="rounding from unloading to loading", lower=1e-9)

    def __post_init__(self) -> None:
        name = type(self).__name__
        require_law(name, self.law)
        super().__post_init__()
        if reason := anisotropy(self.law):
            kind = type(self.law).__name__
            raise ValueError(f"{name}: expected an isotropic law, got {kind}; {reason}")

    @property
    def states(self) -> tuple[State, ...]:
        """Vector states along x, then along y and z, then the states that are numbers."""
        vectors = [s for s in self.law.states if not s.even]
        numbers = tuple(s for s in self.law.states if s.even)
        along = (replace(s, name=f"{s.name}_{x}") for x in self.axes for s in vectors)
        return *along, *numbers

    @property
    def inputs(self) -> tuple[Input, ...]:
        """Further inputs of the law, each a vector of shape (d, 1)."""
        return self.law.inputs

    def _vector(self, a: Scalar) -> Vector:
        return Vector([a[i] for i in range(len(self.axes))], self.turn)

    def _vectors(self, z: Scalar) -> list[Vectors]:
        """Return the states of the law as vectors and numbers, from the rows of `z`."""
        d, even = len(self.axes), [s.even for s in self.law.states]
        n = even.count(False)
        vectors = (self._vector([z[i * n + k] for i in range(d)]) for k in range(n))
        numbers = (z[d * n + k] for k in range(len(even) - n))
        return [next(numbers if is_even else vectors) for is_even in even]

    def _rows(self, z: Sequence[Vectors]) -> Scalar:
        """Return the rows of a column of vectors and numbers."""
        vectors = [a for a in z if isinstance(a, Vector)]
        numbers = [a for a in z if not isinstance(a, Vector)]
        return column(*(a.parts[i] for i in range(len(self.axes)) for a in vectors), *numbers)

    def _given(self, inputs: Mapping[str, Scalar]) -> dict[str, Vector]:
        rest = [0.0] * len(self.axes)
        return {i.name: self._vector(inputs.get(i.name, rest)) for i in self.inputs}

    def force(self, v: Scalar, N: Scalar, z: Scalar = (), **inputs: Scalar) -> Scalar:
        """Return the friction force [N], shape (d, 1), for the sliding velocity v, shape (d, 1)."""
        given = self._given(inputs)
        F = _force(self.law, self._vector(v), N, self._vectors(z), given, self.v_eps)
        return self._rows([F])

    def rate(self, v: Scalar, N: Scalar, z: Scalar = (), **inputs: Scalar) -> Scalar:
        """Return the rates of the states, in the order of `states`."""
        if not self.law.states:
            return empty(v[0])
        given = self._given(inputs)
        return self._rows(_rate(self.law, self._vector(v), N, self._vectors(z), given))

    def steady_state(self, v: Scalar, N: Scalar) -> Scalar:
        """Return the states after long sliding along `v`, in the order of `states`."""
        if not self.law.states:
            return empty(v[0])
        slip = self._vector(v)
        w = slip.length(self.v_eps)
        z = self.law.steady_state(w, N)
        states = enumerate(self.law.states)
        return self._rows([z[k] if s.even else z[k] / w * slip for k, s in states])

    def switches(self, v: Scalar, N: Scalar, z: Scalar = ()) -> tuple[Switch, ...]:
        """Return an empty tuple, since laws with modes are rejected."""
        return ()


@parametric
class PlanarSlip(Isotropic):
    """Isotropic friction law for slip in a plane, d = 2; see `Isotropic`.

    Source: isotropy; LuGre in two dimensions: Velenis, Tsiotras, Canudas de Wit, Vehicle Syst. Dyn.
    43(1), 2005; Bouc-Wen: Park, Wen, Ang, Earthq. Eng. Struct. Dyn. 14(4), 1986 (not read), with
    one product v'z for both axes, which makes it isotropic.
    """

    axes: ClassVar[str] = "xy"


@parametric
class SpatialSlip(Isotropic):
    """Isotropic friction law for slip in space, d = 3, as in a ball joint; see `Isotropic`.

    Limits: bristles do not rotate relative to the axes in which v is expressed.
    Source: isotropy.
    """

    axes: ClassVar[str] = "xyz"


def anisotropy(law: Law) -> str:
    """Return the reason why a law has no isotropic form, or an empty string if it has one."""
    if not _is_odd(law):
        return "it distinguishes forward from backward slip, which has no meaning in a plane"
    N, z = ca.SX.sym("N"), ca.SX.sym("z", len(law.states))
    if law.switches(ca.SX.sym("v"), N, z):
        return (
            "its modes change where v passes through zero, which a vector does not; use a form of "
            "the law without modes"
        )
    v, *vectors = (Vector(ca.vertsplit(ca.SX.sym("a", 2)), 0.0) for _ in (0, *law.states))
    states = [z[k] if s.even else vectors[k] for k, s in enumerate(law.states)]
    inputs = {i.name: v for i in law.inputs}
    try:
        _force(law, v, N, states, inputs, 1e-9)
        _rate(law, v, N, states, inputs)
    except NotIsotropicError as error:
        return f"it {error}"
    return ""


def _is_odd(law: Law) -> bool:
    """Return True if mirrored motion mirrors the force of a law and of all laws it contains."""
    held = [getattr(law, item.name) for item in fields_of(law)]
    inner = [x for value in held for x in (value if isinstance(value, tuple) else (value,))]
    mirrored = law.facts.odd and not isinstance(law, Asymmetric)
    return mirrored and all(_is_odd(x) for x in inner if isinstance(x, Law))


Inputs = Mapping[str, Vector]


def _terms(law: Law, z: Scalar) -> list[tuple[Law, Scalar]]:
    """Return the terms of a sum with their states, or the law itself."""
    return law.terms(z) if isinstance(law, Sum) else [(law, z)]


def _force(
    law: Law, v: Vector, N: Scalar, z: Sequence[Vectors], inputs: Inputs, v_eps: Scalar
) -> Vector:
    """Return the force of a law as a vector; a sum is evaluated term by term."""
    first, *rest = (_term(term, v, N, part, inputs, v_eps) for term, part in _terms(law, z))
    return sum(rest, start=first)


def _term(
    law: Law, v: Vector, N: Scalar, z: Sequence[Vectors], inputs: Inputs, v_eps: Scalar
) -> Vector:
    """Return the force of a term; without states it acts along v or along the lagged velocity."""
    if law.inputs or (z and not isinstance(law, Lagged)):
        return law.force(v, N, z, **chosen(law, inputs))
    law, slip = (law.law, z[0]) if isinstance(law, Lagged) else (law, v)
    w = slip.length(v_eps)
    return law.force(w, N) / w * slip


def _rate(law: Law, v: Vector, N: Scalar, z: Sequence[Vectors], inputs: Inputs) -> list[Vectors]:
    """Return the rates of the states of a law as vectors and numbers."""
    rows: list[Vectors] = []
    for term, part in _terms(law, z):
        if part:
            rate = term.rate(v, N, part, **chosen(term, inputs))
            rows += [rate[k] for k in range(len(part))]
    return rows
