"""One colour and line style for each law, the same in every figure of the gallery."""

from symfric.foundation.parameters import check_names
from symfric.foundation.style import Line, line

LOOKS = {
    "lugre": 0, "dahl": 1, "elasto_plastic": 2, "gonthier": 3, "generic_asperity": 4,
    "exact_coulomb": 4, "leuven": 5, "maxwell_slip": 6, "bengisu_akay": 7, "karnopp": 8,
    "velocity_based": 9, "stick_slip": 10, "threlfall": 11, "brown_mcphee": 12, "awrejcewicz": 13,
    "bliman_sorine": 15, "self_tuning": 16, "gms": 24, "quarter_car_general": 0,
    "quarter_car_simple": 1, "viscous": 5, "steady_state_lugre": 0,
}  # fmt: skip
"""Name in the catalogue -> number in `style.CYCLE`; laws that never meet may share one."""


def look(law: str) -> Line:
    """Colour and line style of a law by its name, as keywords of `Axes.plot`."""
    check_names("gallery", [law], LOOKS)
    return line(LOOKS[law])
