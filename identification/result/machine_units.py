"""Fitted values in the units of a drive: at the load, at the motor, and as currents."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import final

from identification.data.dataset import Dataset
from identification.result.series import Estimate
from symfric.foundation.units import turned

ALONE = "m without rotor"
"""Name of the mass or inertia of the load alone."""
AT_MOTOR = {
    "N m": ("N m", "A", -1),
    "N m s/rad": ("N m s/rad", "A s/rad", -2),
    "N m/rad": ("N m/rad", "A/rad", -2),
    "kg m^2": ("kg m^2", "A s^2/rad", -2),
    "rad/s": ("rad/s", "", 1),
    "rad": ("rad", "", 1),
}
"""Unit of a rotary load -> unit at the motor, unit of the current, and exponent of the ratio."""


@final
@dataclass(frozen=True)
class Sides:
    """Value of a parameter on both sides of a drive.

    The current and the torque of the motor are those for driving the load at efficiency eta_f:

        torque at the motor = force / (ratio eta_f),   current = torque / torque_constant

    An inertia at the motor is m / ratio^2. Coefficients of the velocity, deflection or acceleration
    refer to those of the motor.

    Attributes:
        name: name of the parameter.
        load, motor, current: values; a reversed axis or current changes the sign of an offset only.
        units: their units; "" without a current.
        error: standard error relative to the value; None if unknown.
    """

    name: str
    load: float
    motor: float
    current: float
    units: tuple[str, ...]
    error: float | None = None


def sides_of(data: Dataset, estimates: Mapping[str, Estimate]) -> Iterator[Sides]:
    """Yield the values of a fit to logs of one drive in all units; none without a drive.

    A mass is that of load and rotor; "m without rotor" is that of the load.
    """
    drives = {id(record.drive): record.drive for record in data}
    drive = next(iter(drives.values()))
    if len(drives) > 1 or drive is None:
        return
    ratio, K, rotor = (float(x) for x in (drive.ratio, drive.torque_constant, drive.rotor))
    driving = 1 - drive.losses[0]
    every = {n: e for n, e in estimates.items() if not (e.nuisance or e.fixed)}
    if "m" in every and rotor > 0:
        m = every["m"]
        every[ALONE] = Estimate(m.value - rotor, m.unit, m.standard_error)
    for name, e in every.items():
        if (found := AT_MOTOR.get(e.unit) or AT_MOTOR.get(turned(e.unit))) is None:
            continue
        motor, current, power = found
        signed = name == "offset"  # others are levels in both directions
        scale = (ratio if signed else abs(ratio)) ** power
        at_motor = e.value * scale / (driving if motor.startswith("N") else 1.0)
        amperes = e.value * scale / (driving * (K if signed else abs(K))) if current else 0.0
        error = abs(e.standard_error / e.value) if e.standard_error and e.value else None
        yield Sides(name, e.value, at_motor, amperes, (e.unit, motor, current), error)
