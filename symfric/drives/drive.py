"""Class `Drive`: a motor with gear, encoder and limits, as on its nameplate."""

import tomllib
from collections.abc import Iterator, Mapping
from dataclasses import field, fields
from math import nan, pi
from pathlib import Path
from re import fullmatch
from typing import Any, Self, final

from symfric.foundation import checks, units
from symfric.foundation.numeric import Scalar, equals, is_symbolic
from symfric.foundation.parameters import Parametric, option, param, parametric
from symfric.laws.base import smooth

OF_LOAD = ("resolution", "speed_width", "force_width")
"""Quantities of the load, which are in m and N or in rad and N m."""


def given(unit: str, doc: str) -> Any:
    """Declare a quantity > 0 of a nameplate that may be absent."""
    return field(default=None, metadata={"quantity": unit, "doc": doc})


@final
@parametric
class Drive(Parametric):
    """Motor with a gear, an encoder and limits, which moves a rotary or linear axis.

        ratio = gear_ratio                        rotary axis                        [1]
                gear_ratio 2 pi / lead            screw                              [rad/m]
                gear_ratio / drum_radius          drum, pinion or pulley             [rad/m]
        position of the motor = ratio x,   F_m = ratio torque_constant i
        m_r = ratio^2 rotor_inertia
        F = phi(F_m, v) - m_r a

    x, v, a and F are position, velocity, acceleration and force of the load (m and N, or rad and
    N m of a rotary axis), i is the current [A]. F has the direction of x. A negative `gear_ratio`
    reverses the direction: then a positive current drives the load towards negative x.

    The efficiency is eta_f while the motor drives the load, F_m v > 0, and eta_b while the load
    drives the motor, F_m v < 0. A share of the power is lost in both cases:

        phi = eta_f F_m  if F_m v > 0,   F_m / eta_b  if F_m v < 0,   F_m  at rest

    The loss rises smoothly (C2) from zero at rest to its value at `speed_width`; |F_m| is rounded
    over `force_width`. Both are widths at the load, so that gear ratio and torque constant do not
    change the motion of a load under F_m. Efficiencies of 1 give phi = F_m without smoothing.

    Limits: the losses are those of the torque of the windings. The torque that accelerates the
    rotor does not pass the gear, so that the loss is off by up to (1 - eta) m_r |a|. A gear that
    holds its load by friction at rest needs a friction law as well; eta_b = 0 (self-locking) is
    refused. Iron losses, torque ripple and the lag of the current controller are not modelled.
    Source: H. Gross, J. Hamann, G. Wiegaertner, Electrical Feed Drives in Automation, 2001 (written
    from memory), for reflected inertia and screws; efficiency by direction of the power flow as in
    catalogues of gears and ball screws.

    Attributes:
        torque_constant: torque per current [N m/A]; 1 if currents are torques of the motor, below 0
            if a positive current turns the motor against its encoder.
        gear_ratio: turns of the motor per turn of the output; a reducing gear has more than 1.
        efficiency: number in (0, 1], or (forward, backward), of gear and screw together.
        rotor_inertia: inertia of rotor, brake and coupling on the side of the motor [kg m^2].
        resistance: of the windings, for the copper loss i^2 resistance [Ohm].
        lead: travel of a screw per turn of the output [m]; makes the axis linear.
        drum_radius: radius of a drum, pinion or pulley [m]; makes the axis linear.
        max_current: largest current [A].
        max_torque: largest torque of the motor [N m].
        counts_per_turn: counts of the encoder per turn, after quadrature.
        resolution: count of the encoder in units of the load [m or rad], instead.
        counter: number of counts after which the counter wraps, 65536 for 16 bit.
        encoder: "motor" or "load", the side of measured angles, speeds and counts. Lengths and
            their rates are always those of the load.
        speed_width: speed of the load below which the direction of power is smoothed [m/s, rad/s].
        force_width: force at the load over which |F_m| is rounded [N, N m].

    Raises:
        ValueError: all wrong values in one error.
    """

    torque_constant: Scalar = param(nan, unit="N m/A", doc="torque per current")
    gear_ratio: Scalar = param(1.0, unit="1", doc="turns of the motor per turn of the output")
    efficiency: float | tuple[float, float] = (1.0, 1.0)
    rotor_inertia: Scalar = param(
        0.0, unit="kg m^2", role="inertia", doc="inertia on the side of the motor", lower=0.0
    )
    resistance: Scalar = param(0.0, unit="Ohm", doc="resistance of the windings", lower=0.0)
    lead: float | None = given("m", "travel of a screw per turn")
    drum_radius: float | None = given("m", "radius of a drum, pinion or pulley")
    max_current: float | None = given("A", "largest current")
    max_torque: float | None = given("N m", "largest torque of the motor")
    counts_per_turn: float | None = given("1", "counts of the encoder per turn")
    resolution: float | None = given("m", "count of the encoder at the load")
    counter: float | None = given("1", "counts after which the counter wraps")
    encoder: str = option("motor", choices=("motor", "load"), doc="side of measured angles")
    speed_width: Scalar = param(
        1e-3, unit="m/s", role="width", doc="speed of full losses", lower=1e-12
    )
    force_width: Scalar = param(1e-3, unit="N", role="width", doc="rounding of |F_m|", lower=0.0)

    def __post_init__(self) -> None:
        problems = [*self._problems()]
        try:
            super().__post_init__()
        except ValueError as error:
            hint = "none; it is 1 if currents are torques of the motor"
            text = str(error).removeprefix("Drive: ")
            problems.insert(0, text.replace("or a symbol, got nan", f"or a symbol, got {hint}"))
        if problems:
            raise ValueError("Drive: " + "; ".join(problems))

    def _problems(self) -> Iterator[str]:
        pair = self.efficiency if isinstance(self.efficiency, tuple | list) else (self.efficiency,)
        numbers = [checks.as_number(eta) for eta in pair]
        if len(pair) > 2 or not all(n is not None and 0 < n <= 1 for n in numbers):
            what = "a number > 0 and <= 1, or (forward, backward)"
            yield str(checks.refused("efficiency", what, self.efficiency))
        object.__setattr__(self, "efficiency", (numbers[0], numbers[-1]))
        for name in ("torque_constant", "gear_ratio"):
            if equals(getattr(self, name), 0.0):
                yield f"{name}: expected a number other than 0, got 0; below 0 it reverses the axis"
        for item in fields(self):
            unit, value = item.metadata.get("quantity", ""), getattr(self, item.name)
            if unit and value is not None:
                number = checks.as_number(value)
                if number is None or not 0 < number < 1e300:
                    unit = "m or rad" if item.name == "resolution" else unit
                    yield str(checks.refused(item.name, f"a number > 0 [{unit}]", value))
        for pair in (("lead", "drum_radius"), ("counts_per_turn", "resolution")):
            if all(getattr(self, name) is not None for name in pair):
                yield f"expected one of {' and '.join(pair)}, got both"

    @classmethod
    def read(cls, path: str | Path) -> Self:
        """Return the drive of a TOML file with a unit in each key.

            "torque_constant [mN m/A]" = 120
            gear_ratio = 10
            efficiency = [0.92, 0.88]
            "rotor_inertia [kg cm^2]" = 0.6
            "lead [mm]" = 5
            "max_current [A]" = 8
            counts_per_turn = 4096

        Keys are the attributes of `Drive`; numbers without dimension have no unit.

        Raises:
            ValueError: no readable file, unknown keys, keys without a unit or with another one,
                or wrong values; all in one error.
        """
        file = checks.path("Drive.read", path)
        where = f"drive '{file}'"
        try:
            data = tomllib.loads(file.read_text("utf-8"))
        except OSError as error:
            got = error.strerror or error
            raise ValueError(f"{where}: expected a readable file, got {got}") from None
        except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
            raise ValueError(f"{where}: expected TOML, got an error: {error}") from None
        values, problems = dict[str, Any](), list[str]()
        keys = {key: _name_and_unit(key) for key in data}
        known = {item.name: item.metadata for item in fields(cls)}
        try:
            checks.check_names("key", [name for name, _ in keys.values()], known)
        except ValueError as error:
            problems.append(str(error))
        for key, value in data.items():
            name, unit = keys[key]
            if name not in known:
                continue
            try:
                factor = _factor(name, unit, known[name])
                values[name] = value if factor == 1 else factor * checks.number(key, value)
            except ValueError as error:
                problems.append(str(error))
        found: Self | None = None
        try:
            found = None if problems else cls(**values)
        except ValueError as error:
            problems.append(str(error).removeprefix("Drive: "))
        if found is None:
            raise ValueError(f"{where}: " + "; ".join(problems))
        return found

    @property
    def turning(self) -> bool:
        """True for a rotary axis."""
        return self.lead is None and self.drum_radius is None

    @property
    def ratio(self) -> Scalar:
        """Angle of the motor per position of the load [1 or rad/m]."""
        if self.lead is not None:
            return self.gear_ratio * (2 * pi / self.lead)
        return self.gear_ratio if self.drum_radius is None else self.gear_ratio / self.drum_radius

    @property
    def force_constant(self) -> Scalar:
        """Force at the load per current, without losses, ratio torque_constant [N/A or N m/A]."""
        return self.ratio * self.torque_constant

    @property
    def rotor(self) -> Scalar:
        """Inertia of the rotor at the load, ratio^2 rotor_inertia [kg or kg m^2]."""
        return self.ratio**2 * self.rotor_inertia

    @property
    def current_limit(self) -> float | None:
        """Smaller one of `max_current` and max_torque / torque_constant [A]; None without both."""
        limits = [] if self.max_current is None else [self.max_current]
        if self.max_torque is not None:
            if is_symbolic(self.torque_constant):
                what = "max_current with a symbol as torque_constant"
                raise checks.refused("Drive: max_torque", what, self.max_torque)
            limits.append(self.max_torque / abs(float(self.torque_constant)))
        return min(limits, default=None)

    @property
    def count(self) -> float | None:
        """Count of the encoder in units of the load [m or rad]; None if unknown.

        It has the sign of `gear_ratio` for an encoder of the motor.
        """
        if self.counts_per_turn is None:
            return self.resolution
        angle = 2 * pi / self.counts_per_turn
        return angle / float(
            self.ratio if self.encoder == "motor" else self.ratio / self.gear_ratio
        )

    def at_load(self, F_m: Scalar, v: Scalar) -> Scalar:
        """Return phi(F_m, v), the force at the load after the losses of the gear [N or N m].

        Args:
            F_m: force at the load without losses, `force_constant` times the current [N or N m].
            v: velocity of the load [m/s or rad/s].
        """
        mean, half = self._shares(v)
        if equals(half, 0.0):
            return F_m
        return mean * F_m + half * smooth.magnitude(F_m, self.force_width)

    def from_load(self, F: Scalar, v: Scalar) -> Scalar:
        """Return F_m for the force F = phi(F_m, v) at the load [N or N m].

        It is the inverse of `at_load` up to the rounding of |F_m|.
        """
        mean, half = self._shares(v)
        if equals(half, 0.0):
            return F
        driving, driven = 1 / (mean + half), 1 / (mean - half)
        size = smooth.magnitude(F, self.force_width)
        return ((driving + driven) * F + (driving - driven) * size) / 2

    def current_for(self, F: Scalar, v: Scalar) -> Scalar:
        """Return the current [A] for the force F at the load at the velocity v; see `from_load`."""
        return self.from_load(F, v) / self.force_constant

    def _shares(self, v: Scalar) -> tuple[Scalar, Scalar]:
        """Return a and b in phi = a F_m + b |F_m|."""
        forward, backward = self.losses
        if forward == backward == 0.0:
            return 1.0, 0.0
        up, down = (smooth.step5(side * v / self.speed_width) for side in (1, -1))
        mean = 1 + (backward - forward) / 2 * (up + down)
        return mean, -(forward + backward) / 2 * (up - down)

    @property
    def losses(self) -> tuple[float, float]:
        """Losses 1 - eta_f and 1 / eta_b - 1 relative to |F_m|."""
        forward, backward = self.efficiency  # pyright: ignore[reportGeneralTypeIssues, reportUnknownVariableType]
        return 1 - forward, 1 / backward - 1


def _name_and_unit(key: str) -> tuple[str, str | None]:
    """Return name and unit of a key such as `lead [mm]`."""
    match = fullmatch(r"\s*(\w+)\s*(?:\[(.*)\])?\s*", key)
    return (match[1], match[2]) if match else (key, None)


def _factor(name: str, unit: str | None, known: Mapping[str, Any]) -> float:
    """Return the factor from the unit of a key to SI units."""
    wanted = known.get("quantity", known.get("unit", "1"))
    if wanted == "1" and unit is None:
        return 1.0
    both = (wanted, units.turned(wanted)) if name in OF_LOAD else (wanted,)
    meant = units.parsed(unit or "?")
    if meant is None or meant.si not in [found.si for one in both if (found := units.parsed(one))]:
        such = f'a unit of {wanted} in its key, such as "{name} [{wanted}]"'
        raise ValueError(f"{name}: expected {such}, got {unit or 'none'}")
    return meant.factor
