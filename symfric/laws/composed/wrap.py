"""Laws evaluated by other laws, and wrappers: exact stick, lag, temperature, and load."""

from abc import abstractmethod
from dataclasses import fields as fields_of
from dataclasses import replace
from itertools import accumulate, pairwise

from symfric.foundation.numeric import Scalar, column, empty, exp, smallest, total
from symfric.foundation.parameters import distinct, parameters, parametric, with_values
from symfric.laws.base import fields
from symfric.laws.base.law import Facts, Input, Law, State, Switch, chosen, require_law


class Composed(Law):
    """Law evaluated by other laws: the sum of their forces, with the states of all of them.

    F = sum of F_i(v, load(N), z_i)
    """

    @abstractmethod
    def at(self, v: Scalar) -> tuple[Law, ...]:
        """Return the laws with their parameters at the sliding velocity `v`."""

    @abstractmethod
    def on_side(self, side: int) -> tuple[Law, ...]:
        """Return the laws with their parameters on one side of v = 0."""

    def load(self, N: Scalar) -> Scalar:
        """Return the normal force [N] of the laws."""
        return N

    def terms(self, z: Scalar, v: Scalar = 0.0) -> list[tuple[Law, Scalar]]:
        """Return each law at the velocity `v` with its rows of `z`."""
        laws = self.at(v)
        if len(laws) == 1:
            return [(laws[0], z)]
        ends = accumulate((len(law.states) for law in laws), initial=0)
        return [(law, z[a:b]) for law, (a, b) in zip(laws, pairwise(ends), strict=True)]

    @property
    def states(self) -> tuple[State, ...]:
        """States of all laws, in their order; repeated names get the number of their law."""
        laws = self.on_side(1)
        names = distinct([[state.name for state in law.states] for law in laws])
        return tuple(
            replace(state, name=name)
            for law, group in zip(laws, names, strict=True)
            for state, name in zip(law.states, group, strict=True)
        )

    @property
    def inputs(self) -> tuple[Input, ...]:
        """Further inputs of all laws, without duplicates."""
        return tuple(dict.fromkeys(i for law in self.on_side(1) for i in law.inputs))

    @property
    def velocity_scale(self) -> Scalar:
        """Smallest velocity scale of the laws [m/s]."""
        return smallest(*(law.velocity_scale for law in self.on_side(1)))

    def force(self, v: Scalar, N: Scalar, z: Scalar = (), **inputs: Scalar) -> Scalar:
        """Return the friction force [N]."""
        terms, load = self.terms(z, v), self.load(N)
        return total(law.force(v, load, part, **chosen(law, inputs)) for law, part in terms)

    def sliding(self, v: Scalar, N: Scalar, side: int, **inputs: Scalar) -> Scalar:
        """Return the sum of the sliding forces [N] on one side."""
        laws, load = self.on_side(side), self.load(N)
        return total(law.sliding(v, load, side, **chosen(law, inputs)) for law in laws)

    def static_level(self, N: Scalar, side: int = 1, **inputs: Scalar) -> Scalar:
        """Return the sum of the static levels [N]."""
        laws, load = self.on_side(side), self.load(N)
        return total(law.static_level(load, side, **chosen(law, inputs)) for law in laws)

    def most_held(self, N: Scalar, side: int = 1, **inputs: Scalar) -> Scalar:
        """Return the sum of the bounds [N] of the laws."""
        laws, load = self.on_side(side), self.load(N)
        return total(law.most_held(load, side, **chosen(law, inputs)) for law in laws)

    def rate(self, v: Scalar, N: Scalar, z: Scalar = (), **inputs: Scalar) -> Scalar:
        """Return the rates of all states."""
        terms, load = self.terms(z, v), self.load(N)
        rates = [law.rate(v, load, x, **chosen(law, inputs)) for law, x in terms if law.states]
        return _join(v, rates)

    def switches(
        self, v: Scalar, N: Scalar, z: Scalar = (), **inputs: Scalar
    ) -> tuple[Switch, ...]:
        """Return the changes of mode of all laws, with the state names of this law."""
        names = iter(state.name for state in self.states)
        switches: list[Switch] = []
        for law, part in self.terms(z, v):
            new = {state.name: next(names) for state in law.states}
            for switch in law.switches(v, self.load(N), part, **chosen(law, inputs)):
                reset = {new[name]: value for name, value in switch.reset.items()}
                switches.append(replace(switch, reset=reset))
        return tuple(switches)

    def held_step(self, v: Scalar, N: Scalar, z: Scalar, h: Scalar) -> tuple[Scalar, Scalar] | None:
        """Return the held steps of the laws; None if a law with states has none."""
        terms, load = self.terms(z, v), self.load(N)
        known = [law.held_step(v, load, part, h) for law, part in terms if law.states]
        steps = [step for step in known if step is not None]
        if not steps or len(steps) < len(known):
            return None
        return _join(v, [end for end, _ in steps]), _join(v, [mean for _, mean in steps])

    def held_rest(self, v: Scalar, N: Scalar, z: Scalar) -> Scalar | None:
        """Return the equilibria of the laws, or None if no law with states has any.

        For a law without equilibria these are its steady states.
        """
        terms, load = self.terms(z, v), self.load(N)
        known = [(law, law.held_rest(v, load, part)) for law, part in terms if law.states]
        if all(rest is None for _, rest in known):
            return None
        return _join(v, [law.steady_state(v, load) if r is None else r for law, r in known])

    def steady_state(self, v: Scalar, N: Scalar) -> Scalar:
        """Return the steady states of all laws."""
        return self.steady_state_at(v, N)

    def steady_state_at(self, v: Scalar, N: Scalar, **inputs: Scalar) -> Scalar:
        """Return the steady states of all laws under further inputs."""
        load, laws = self.load(N), [law for law in self.at(v) if law.states]
        return _join(v, [law.steady_state_at(v, load, **chosen(law, inputs)) for law in laws])

    def warnings(self) -> tuple[str, ...]:
        """Return the warnings of the laws."""
        return tuple(warning for law in self.on_side(1) for warning in law.warnings())


def _join(v: Scalar, columns: list[Scalar]) -> Scalar:
    """Return the rows of all `columns` in one column."""
    if len(columns) < 2:
        return columns[0] if columns else empty(v)
    return column(*(row for c in columns for row in (c[i] for i in range(c.shape[0]))))


class Wrapper(Composed):
    """Law that evaluates another law with modified parameters or a modified normal force.

        F = F_inner(v)(v, load(N), z)

    Subclasses override `inner`, `inner_at`, `on_side`, `load` or methods of `Law`.
    """

    law: Law

    def __post_init__(self) -> None:
        for item in fields_of(self):
            if "unit" not in item.metadata:
                require_law(type(self).__name__, getattr(self, item.name))
        super().__post_init__()

    @property
    def inner(self) -> Law:
        """Wrapped law."""
        return self.law

    def inner_at(self, v: Scalar) -> Law:
        """Return the wrapped law with its parameters at the sliding velocity `v`."""
        return self.inner

    def at(self, v: Scalar) -> tuple[Law, ...]:
        """Return the wrapped law with its parameters at the sliding velocity `v`."""
        return (self.inner_at(v),)

    def on_side(self, side: int) -> tuple[Law, ...]:
        """Return the wrapped law with its parameters on one side of v = 0."""
        return (self.inner,)


@parametric
class Lagged(Wrapper):
    """Law without states whose force follows the velocity with a lag (one state).

        dw/dt = (v - w) / tau_L
        F     = F_law(w, N)

    The wrapper adds frictional lag to a static law: while the velocity rises, the force is the one
    of a lower velocity. After a reversal of v the force keeps its sign for about tau_L, during
    which it drives the motion.
    Limits: the law itself if v changes slowly compared with tau_L; for bearings tau_L is 1 to
    50 ms. In C with float, w has an error of 1e-7 of the largest velocity: use double if this is
    not small compared with the smoothing velocity.
    Source: Hess and Soom, ASME J. Tribol. 112(1), 1990 (pure delay); first-order form constructed.
    """

    facts = Facts(("L",), "that of its law", "constructed")

    law: Law
    tau_L: Scalar = fields.TIME(0.01, doc="time constant of the lag")

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.law.states:
            raise ValueError(
                "Lagged: expected a law without states, got "
                f"{type(self.law).__name__}; laws with states have their own lag"
            )

    @property
    def states(self) -> tuple[State, ...]:
        """Lagged velocity w, at which the force is evaluated."""
        return (State("w", "m/s", 0.1, doc="velocity that the force follows"),)

    def force(self, v: Scalar, N: Scalar, z: Scalar = (), **inputs: Scalar) -> Scalar:
        """Return the friction force [N]."""
        return self.law.force(z[0], N, **inputs)

    def rate(self, v: Scalar, N: Scalar, z: Scalar = (), **inputs: Scalar) -> Scalar:
        """Return the rate of the lagged velocity [m/s^2], shape (1, 1)."""
        return column((v - z[0]) / self.tau_L)

    def steady_state_at(self, v: Scalar, N: Scalar, **inputs: Scalar) -> Scalar:
        """Return the velocity itself, shape (1, 1)."""
        return column(v)

    def held_step(self, v: Scalar, N: Scalar, z: Scalar, h: Scalar) -> None:
        """Return None, since the law has no modes."""


@parametric
class TemperatureDependent(Wrapper):
    """Law whose coefficients decrease with the temperature.

        mu(T)      = mu      exp(-k_dry (T - T_0))   every dry level: coefficient or force
        sigma_2(T) = sigma_2 exp(-k_wet (T - T_0))   every viscous coefficient

    All parameters with the `role` "level" or "viscous" are scaled. T [K] is a parameter, so that it
    may be a number or a symbol of another model.
    Limits: T = T_0 is the law itself. The exponentials are valid over some tens of kelvins. For
    oils k_wet is 0.02 to 0.05 1/K.
    Source: Reynolds' viscosity equation; for robot joints Bittencourt and Gunnarsson, J. Dyn. Syst.
    Meas. Control 134(5), 2012, with other functions of T.
    """

    facts = Facts((), "that of its law", "constructed")

    law: Law
    T: Scalar = fields.TEMPERATURE(293.15, doc="temperature", lower=0.0)
    T_0: Scalar = fields.TEMPERATURE(293.15, doc="temperature of the coefficients", lower=0.0)
    k_dry: Scalar = fields.TEMPERATURE(0.0, unit="1/K", doc="fall of the friction coefficients")
    k_wet: Scalar = fields.TEMPERATURE(0.03, unit="1/K", doc="fall of the viscous coefficients")

    def __post_init__(self) -> None:
        super().__post_init__()
        if not {"level", "viscous"} & {p.role for p in parameters(self.law).values()}:
            raise ValueError(
                "TemperatureDependent: expected a law with a dry level or a viscous coefficient, "
                f"got {type(self.law).__name__}, which has no parameter of either role"
            )

    @property
    def inner(self) -> Law:
        """Law with the coefficients at the temperature T."""
        rise = self.T - self.T_0
        falls = {"level": exp(-self.k_dry * rise), "viscous": exp(-self.k_wet * rise)}
        known = parameters(self.law).items()
        return with_values(
            self.law, {name: p.value * falls[p.role] for name, p in known if p.role in falls}
        )


@parametric
class LoadNormalised(Wrapper):
    """Law evaluated at a fixed load, with its force scaled to the actual load.

        F     = N / N_0 F_law(v, N_0, z)
        dz/dt = rate_law(v, N_0, z)

    The deflection of a bristle law in newtons depends on the load. If the load falls, the bristles
    keep their force, so that joints with friction from reactions may have no solution. In this
    wrapper the deflection does not depend on the load, the force follows the load immediately, and
    N = 0 gives zero force.
    Limits: N = N_0 is the law itself, as is any N for a law without states whose force is
    proportional to the load; `LuGre` becomes `LuGreNormalised` with sigma_i / N_0. The whole force
    is scaled, including viscous friction. A load that increases on a deflected bristle does work.
    Source: LuGre in coefficients of friction, Canudas de Wit and Tsiotras, CDC 1999; constructed
    for other laws.
    """

    facts = Facts((), "that of its law", "constructed")

    law: Law
    N_0: Scalar = fields.LOAD(0.8 * 9.81, doc="load at which it is the law itself", lower=1e-12)

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.law.inputs:
            raise ValueError(
                "LoadNormalised: expected a law of v and N, got "
                f"{type(self.law).__name__}, which needs {self.law.inputs[0].name}; it carries "
                "the applied force in stick, independent of the load"
            )

    def load(self, N: Scalar) -> Scalar:
        """Return N_0 [N] for every load."""
        return self.N_0

    def force(self, v: Scalar, N: Scalar, z: Scalar = (), **inputs: Scalar) -> Scalar:
        """Return the friction force [N], scaled by N / N_0."""
        return N / self.N_0 * super().force(v, N, z)

    def sliding(self, v: Scalar, N: Scalar, side: int, **inputs: Scalar) -> Scalar:
        """Return the sliding force [N] on one side, scaled by N / N_0."""
        return N / self.N_0 * super().sliding(v, N, side)

    def static_level(self, N: Scalar, side: int = 1, **inputs: Scalar) -> Scalar:
        """Return the largest force [N] at rest, scaled by N / N_0."""
        return N / self.N_0 * super().static_level(N, side)

    def most_held(self, N: Scalar, side: int = 1, **inputs: Scalar) -> Scalar:
        """Return the bound [N] at the load N_0, scaled by N / N_0."""
        return N / self.N_0 * super().most_held(N, side)
