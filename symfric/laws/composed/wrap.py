"""Laws around a law: its velocity lags, its coefficients follow a temperature."""

from dataclasses import dataclass
from typing import ClassVar, final

from symfric.foundation.numeric import Scalar, column, exp
from symfric.foundation.parameters import param, parameters, with_values
from symfric.laws.base.law import Facts, Input, Law, State, Switch, check_law


@final
@dataclass(frozen=True, eq=False)
class Lagged(Law):
    """A law without states that follows the velocity with a lag (one state).

        dw/dt = (v - w) / tau_L
        F     = F_law(w, N)

    Gives frictional lag to any static law: while the velocity rises the force is that of a lower
    velocity, and after a reversal it keeps its sign for about tau_L, so it may push for an instant.
    Limits: the law itself for v that changes slowly against tau_L; tau_L of bearings 1 to 50 ms.
    As C in float the force is as uncertain as w, 1e-7 of the largest velocity: use double where
    that is not small against the smoothing velocity.
    Source: Hess and Soom, ASME J. Tribol. 112(1), 1990 (pure delay); first-order form constructed.
    """

    facts: ClassVar[Facts] = Facts(("L",), "that of its law", "constructed", "Hess and Soom 1990")

    law: Law
    tau_L: Scalar = param(0.01, unit="s", doc="time constant of the lag", lower=1e-12)

    def __post_init__(self) -> None:
        check_law("Lagged", self.law)
        super().__post_init__()
        if self.law.states:
            raise ValueError(
                "Lagged: expected a law without states, got "
                f"{type(self.law).__name__}; laws with states have a lag of their own"
            )

    @property
    def states(self) -> tuple[State, ...]:
        """The velocity that the force follows."""
        return (State("w", "m/s", 0.1),)

    @property
    def inputs(self) -> tuple[Input, ...]:
        """The further inputs of the law."""
        return self.law.inputs

    @property
    def velocity_scale(self) -> Scalar:
        """That of the law [m/s]."""
        return self.law.velocity_scale

    def force(self, v: Scalar, N: Scalar, z: Scalar = (), **inputs: Scalar) -> Scalar:
        """Friction force [N]."""
        return self.law.force(z[0], N, **inputs)

    def rate(self, v: Scalar, N: Scalar, z: Scalar = (), **inputs: Scalar) -> Scalar:
        """Rate of the velocity that the force follows [m/s^2], shape (1, 1)."""
        return column((v - z[0]) / self.tau_L)

    def steady_state(self, v: Scalar, N: Scalar) -> Scalar:
        """The velocity itself, shape (1, 1)."""
        return column(v)

    def warnings(self) -> tuple[str, ...]:
        """Those of the law."""
        return self.law.warnings()


@final
@dataclass(frozen=True, eq=False)
class TemperatureDependent(Law):
    """A law whose coefficients fall with the temperature.

        mu(T)      = mu      exp(-k_dry (T - T_0))   every friction coefficient mu... [1]
        sigma_2(T) = sigma_2 exp(-k_wet (T - T_0))   every viscous coefficient [N s/m]

    T [K] is a parameter: a number, or a symbol that something else determines.
    Limits: T = T_0 is the law itself. The exponential holds over some ten kelvin, for oils with
    k_wet of 0.02 to 0.05 1/K.
    Source: Reynolds' viscosity equation; for robot joints Bittencourt and Gunnarsson, J. Dyn. Syst.
    Meas. Control 134(5), 2012, with other functions of T.
    """

    facts: ClassVar[Facts] = Facts(
        (), "that of its law", "constructed", "Reynolds' viscosity equation"
    )

    law: Law
    T: Scalar = param(293.15, unit="K", doc="temperature", lower=0.0)
    T_0: Scalar = param(293.15, unit="K", doc="temperature of the coefficients", lower=0.0)
    k_dry: Scalar = param(0.0, unit="1/K", doc="fall of the friction coefficients")
    k_wet: Scalar = param(0.03, unit="1/K", doc="fall of the viscous coefficients")

    def __post_init__(self) -> None:
        check_law("TemperatureDependent", self.law)
        super().__post_init__()

    def at_temperature(self) -> Law:
        """The law with the coefficients of the temperature T."""
        rise = self.T - self.T_0
        dry, wet = exp(-self.k_dry * rise), exp(-self.k_wet * rise)
        known = parameters(self.law)
        viscous = [n for n, p in known.items() if p.doc.startswith("viscous coefficient")]
        coefficients = [n for n, p in known.items() if n.startswith("mu") and p.unit == "1"]
        changed = {n: known[n].value * wet for n in viscous}
        changed |= {n: known[n].value * dry for n in coefficients if n not in viscous}
        return with_values(self.law, changed)

    @property
    def states(self) -> tuple[State, ...]:
        """The states of the law."""
        return self.law.states

    @property
    def inputs(self) -> tuple[Input, ...]:
        """The further inputs of the law."""
        return self.law.inputs

    @property
    def velocity_scale(self) -> Scalar:
        """That of the law [m/s]."""
        return self.law.velocity_scale

    def force(self, v: Scalar, N: Scalar, z: Scalar = (), **inputs: Scalar) -> Scalar:
        """Friction force [N]."""
        return self.at_temperature().force(v, N, z, **inputs)

    def rate(self, v: Scalar, N: Scalar, z: Scalar = (), **inputs: Scalar) -> Scalar:
        """Rates of the states of the law."""
        return self.at_temperature().rate(v, N, z, **inputs)

    def switches(
        self, v: Scalar, N: Scalar, z: Scalar = (), **inputs: Scalar
    ) -> tuple[Switch, ...]:
        """The changes of mode of the law."""
        return self.at_temperature().switches(v, N, z, **inputs)

    def steady_state(self, v: Scalar, N: Scalar) -> Scalar:
        """Steady states of the law."""
        return self.at_temperature().steady_state(v, N)

    def held_step(self, v: Scalar, N: Scalar, z: Scalar, h: Scalar) -> tuple[Scalar, Scalar] | None:
        """That of the law."""
        return self.at_temperature().held_step(v, N, z, h)

    def warnings(self) -> tuple[str, ...]:
        """Those of the law at this temperature."""
        return self.at_temperature().warnings()
