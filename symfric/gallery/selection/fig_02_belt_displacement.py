"""Displacement of the block on the belt, eleven laws.

Compared: S, the standard deviation of the positions, with the paper's table 4; the positions with
exact dry friction in closed form.

Distance: largest deviation of S from table 4, relative.

Evidence: that S tells the stability of a solution is refuted. Taken every ms it is 14.5 ... 15.0 cm
for all laws with a static level, 14.6 cm for exact dry friction: it measures the amplitude. Taken
at the steps of the solver it is 10 ... 22 cm for the very same motions; table 4 does not say where.
That the laws part by accumulated errors is refuted, too: a hundred times sharper tolerance changes
no position by more than a micrometre, while the laws are centimetres apart. That Coulomb, Threlfall
and Dahl do not stick is confirmed.
"""

from symfric.gallery.plate import Plate, plate_of
from symfric.gallery.selection._laws import SLIDING, TABLE_4, chosen, small_multiples
from symfric.gallery.selection._runs_belt import T_END, exact, run
from symfric.gallery.signals import largest, rms, spread


def plate(quick: bool = False) -> Plate:
    """20 s from rest, tables 2 and 3."""
    names, t_end = chosen(quick), 8.0 if quick else T_END
    runs = {name: run(name, t_end) for name in names}
    _, dry = exact(t_end)

    t = runs[names[0]].t
    curves = {name: (one.t, one["x"]) for name, one in runs.items()}
    figure = small_multiples(curves, (t, dry["x"]), "displacement of the block [m]")

    S = {name: spread(one["x"]) for name, one in runs.items()}
    off = [abs(S[name] / TABLE_4[name] - 1) for name in names]
    numbers = {"S x 100, exact dry friction [m]": spread(dry["x"])}
    for name, one in runs.items():
        steps = one.at(one.step_times)["x"]
        numbers[f"S x 100, {name} [m]"] = S[name]
        numbers[f"S x 100 in table 4, {name} [m]"] = TABLE_4[name]
        numbers[f"S x 100 at the steps of the solver, {name} [m]"] = spread(steps)
        numbers[f"rms distance from exact dry friction, {name} [m]"] = rms(one["x"] - dry["x"])
        numbers[f"greatest displacement, {name} [m]"] = float(one["x"].max())
    if not quick:
        held = [S[name] for name in names if name not in SLIDING]
        sharper = (run(name, t_end, 1e-9)["x"] - one["x"] for name, one in runs.items())
        numbers["largest change by a tolerance of 1e-9 [m]"] = max(map(largest, sharper))
        for what, one in (("least", min), ("greatest", max)):
            numbers[f"{what} S x 100 of a law with a static level [m]"] = one(held)
    return plate_of(__name__, figure, max(off), "1", numbers)
