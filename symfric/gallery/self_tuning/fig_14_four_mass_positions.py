"""Positions of the four masses.

Compared: both laws, each with the same machine in two coordinates, written by hand and solved by
SUNDIALS; and with each other.

Distance: largest difference of a position from that by hand, both laws.

Reproduced: both laws move the masses alike, within 18 mm in a system of 7 m. Energy falls
monotonically with both, as it must, and the joints are not violated, as the paper has it: the norms
of their constraints are those of rounding.

Undecided: the data of the machine, which are Haug's here.
"""

from symfric.gallery.plate import Plate, plate_of
from symfric.gallery.self_tuning._runs_four_mass import (
    CONSTRAINTS,
    LAWS,
    V_T,
    apart,
    distance,
    picture,
    run,
)
from symfric.gallery.signals import largest


def plate(quick: bool = False) -> Plate:
    """4 s from the start of Haug's example."""
    t_end = 0.4 if quick else 4.0
    numbers = {f"laws apart, {slider} [m]": d for slider, d in apart("", t_end).items()}
    for law in LAWS:
        energy = run(law, V_T, t_end)["energy"]
        numbers[f"energy lost, {law} [J]"] = float(energy[0] - energy[-1])
        numbers[f"largest rise of energy in 1 ms, {law} [J]"] = float(
            (energy[1:] - energy[:-1]).max()
        )
    for name, unit in CONSTRAINTS.items():
        worst = max(largest(run(law, V_T, t_end)[name]) for law in LAWS)
        numbers[f"largest {name} [{unit}]"] = worst
    rises = [value for name, value in numbers.items() if name.startswith("largest rise")]
    most = max(apart("", t_end).values())
    claims = {
        "energy falls monotonically": max(rises) < 0,
        "constraints hold": all(
            numbers[f"largest {n} [{u}]"] < 1e-7 for n, u in CONSTRAINTS.items()
        ),
        "laws are within 18 mm": most < 0.0185,
    }
    figure = picture("", "position [m]", t_end)
    far, within = distance("", t_end), 1e-8
    return plate_of(__name__, figure, far, "m", numbers, claims, within=within, quick=quick)
