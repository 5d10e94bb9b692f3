"""Laws around a law: its velocity lags, its coefficients follow a temperature."""

from dataclasses import dataclass
from typing import ClassVar, final

from symfric.foundation.numeric import Scalar, column, exp
from symfric.foundation.parameters import param, parameters, with_values
from symfric.laws.base.law import Facts, Law, State, check_law
from symfric.laws.composed.wrapper import Wrapper


@final
@dataclass(frozen=True, eq=False)
class Lagged(Wrapper):
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
    tau_L: Scalar = param(0.01, unit="s", role="time", doc="time constant of the lag", lower=1e-12)

    def __post_init__(self) -> None:
        check_law("Lagged", self.law)
        super().__post_init__()
        if self.law.states:
            raise ValueError(
                "Lagged: expected a law without states, got "
                f"{type(self.law).__name__}; laws with states have a lag of their own"
            )

    @property
    def inner(self) -> Law:
        """The law that is wrapped."""
        return self.law

    @property
    def states(self) -> tuple[State, ...]:
        """The velocity that the force follows."""
        return (State("w", "m/s", 0.1, doc="velocity that the force follows"),)

    def force(self, v: Scalar, N: Scalar, z: Scalar = (), **inputs: Scalar) -> Scalar:
        """Friction force [N]."""
        return self.law.force(z[0], N, **inputs)

    def rate(self, v: Scalar, N: Scalar, z: Scalar = (), **inputs: Scalar) -> Scalar:
        """Rate of the velocity that the force follows [m/s^2], shape (1, 1)."""
        return column((v - z[0]) / self.tau_L)

    def steady_state(self, v: Scalar, N: Scalar) -> Scalar:
        """The velocity itself, shape (1, 1)."""
        return column(v)

    def held_step(self, v: Scalar, N: Scalar, z: Scalar, h: Scalar) -> None:
        """None: the rate says it all."""


@final
@dataclass(frozen=True, eq=False)
class TemperatureDependent(Wrapper):
    """A law whose coefficients fall with the temperature.

        mu(T)      = mu      exp(-k_dry (T - T_0))   every dry level: coefficient or force
        sigma_2(T) = sigma_2 exp(-k_wet (T - T_0))   every viscous coefficient

    Which parameters these are is their `role`, "level" or "viscous". T [K] is a parameter: a
    number, or a symbol that something else determines.
    Limits: T = T_0 is the law itself. The exponential holds over some ten kelvin, for oils with
    k_wet of 0.02 to 0.05 1/K.
    Source: Reynolds' viscosity equation; for robot joints Bittencourt and Gunnarsson, J. Dyn. Syst.
    Meas. Control 134(5), 2012, with other functions of T.
    """

    facts: ClassVar[Facts] = Facts(
        (), "that of its law", "constructed", "Reynolds' viscosity equation"
    )

    law: Law
    T: Scalar = param(293.15, unit="K", role="temperature", doc="temperature", lower=0.0)
    T_0: Scalar = param(
        293.15, unit="K", role="temperature", doc="temperature of the coefficients", lower=0.0
    )
    k_dry: Scalar = param(
        0.0, unit="1/K", role="temperature", doc="fall of the friction coefficients"
    )
    k_wet: Scalar = param(
        0.03, unit="1/K", role="temperature", doc="fall of the viscous coefficients"
    )

    def __post_init__(self) -> None:
        check_law("TemperatureDependent", self.law)
        super().__post_init__()
        if not {"level", "viscous"} & {p.role for p in parameters(self.law).values()}:
            raise ValueError(
                "TemperatureDependent: expected a law with a dry level or a viscous coefficient, "
                f"got {type(self.law).__name__}, which has no parameter of either role"
            )

    @property
    def inner(self) -> Law:
        """The law with the coefficients of the temperature T."""
        rise = self.T - self.T_0
        falls = {"level": exp(-self.k_dry * rise), "viscous": exp(-self.k_wet * rise)}
        known = parameters(self.law).items()
        return with_values(
            self.law, {name: p.value * falls[p.role] for name, p in known if p.role in falls}
        )
