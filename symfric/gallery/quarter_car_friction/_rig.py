"""The rig of the paper on a road of 30, 50 or 70 mm."""

from collections.abc import Mapping
from functools import cache
from itertools import pairwise

from symfric import QuarterCarGeneral, Trajectory, simulate, with_values
from symfric.laws import Law
from symfric.scenes import QuarterCar

START, FIRST, RAMP, HOLD, T_END = 0.3, 2.4, 1.0, 2.0, 12.0  # s
"""Times of the road; START and FIRST follow from the text and are those of the preset (figure 11),
the others are ours."""
STAGES = {"A": (START, 0.0), "B": (4.7, 0.085), "C": (7.7, 0.135), "D": (T_END, 0.035)}
"""End of each rest [s], and where the paper says that the body is then [m]."""
FRICTION = {"C_e": 180.0, "e_1": 0.01, "mu": 0.05, "sigma_v": 1500.0}
"""Friction of the general law [N, m/s, 1, N s/m]; not in the paper."""
WEAK = {"C_e": 120.0, "e_1": 0.02, "mu": 0.08, "sigma_v": 80.0}
"""Another reading of the numbers that the paper does not give, weakly viscous."""
READINGS: tuple[Mapping[str, float], ...] = (
    FRICTION,
    WEAK,
    *(
        FRICTION | {name: value}
        for name, values in {
            "C_e": (90.0,),
            "e_1": (0.003, 0.03),
            "mu": (0.025, 0.1),
            "sigma_v": (300.0, 750.0, 3000.0),
        }.items()
        for value in values
    ),
)
"""Over what the invented numbers may be: what is said of the paper holds for each."""
RAMPS = {
    name: (begin, end)
    for name, (begin, end) in zip(
        ("first", "second", "third"), pairwise(end for end, _ in STAGES.values()), strict=True
    )
}
"""Ramp and the rest behind it: first and last time [s]."""


def general(numbers: Mapping[str, float] = FRICTION, form: str = "smooth") -> QuarterCarGeneral:
    """The general law in narrow windows [m/s, N], since the paper's has none."""
    return with_values(QuarterCarGeneral(v_eps=2e-4, F_eps=0.1, form=form), numbers)


@cache
def read(number: int) -> Trajectory:
    """A run with one of READINGS."""
    return ride(general(READINGS[number]))


def ride(law: Law, millimetres: int = 50, samples: int = 6001) -> Trajectory:
    """A run of the rig with `law` in its guide."""
    name = f"al_zughaibi_{millimetres}_mm"
    car = QuarterCar.preset(name, law, t_ramp=RAMP, t_hold=HOLD)
    return simulate(car.model(), T_END, rtol=1e-8, samples=samples)
