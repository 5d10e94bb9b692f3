"""Units of contacts that turn."""

from symfric import ALL_LAWS, parameters
from symfric.foundation.units import turned


def test_every_unit_of_sliding_has_one_of_turning() -> None:
    """Joints that turn showed m/s and N for rad/s and N m, in the header of their C, too."""
    known = {
        "m/s": "rad/s", "N": "N m", "N s/m": "N m s/rad", "N/m": "N m/rad", "m": "rad",
        "s/m": "s/rad", "1/m": "1/rad", "m/s^2": "rad/s^2", "N s^2/m^2": "N m s^2/rad^2",
        "N (s/m)^d": "N m (s/rad)^d", "N/s": "N m/s", "kg": "kg m^2", "1": "1", "s": "s", "W": "W",
        "rad/s": "rad/s", "N m": "N m", "1/(N m)": "1/(N m)", "N m s/rad": "N m s/rad", "K": "K",
    }  # fmt: skip
    assert {unit: turned(unit) for unit in known} == known
    units = {p.unit for kind in ALL_LAWS.values() for p in parameters(kind()).values()}
    for unit in units - {"1", "s", "K", "degC", "rad", "1/s"}:
        assert "rad" in turned(unit) or "N m" in turned(unit), unit
        assert turned(turned(unit)) == turned(unit)
