"""Displacement of the box, eleven laws.

`symfric select pendulum_box --paper` puts tables 8 and 9 beside ours, law by law and rank by rank.

Compared: S, the standard deviation of the positions, with the paper's table 8; the positions with
exact dry friction.

Distance: median deviation of S from table 8 over the laws, relative.

Evidence: that S tells the stability of a solution is refuted once more: every ms it is 5.7 ... 5.9
cm for ten laws whose boxes lie within 11 mm of exact dry friction. At the steps of the solver the
same motions give 2.8 ... 7.6 cm, which is the spread of table 8, 1.4 ... 7.2 cm, with Stick-slip
below all others as there: it is where a solver takes its steps. Karnopp alone is centimetres off:
its band of 1 mm/s at the hinge's 10 mm, a radius of ours, stops the pendulum below 0.1 rad/s at
every turn; with a hundredth of that band it is where the others are, and so it is in its smooth
form, which stops nothing.
"""

from dataclasses import replace

import numpy as np

from symfric import Karnopp, simulate
from symfric.gallery.plate import Plate, plate_of
from symfric.gallery.selection._laws import LAWS, TABLE_8, chosen
from symfric.gallery.selection._runs_box import EXACT, T_END, box, distance, picture, run
from symfric.gallery.signals import largest, spread


def plate(quick: bool = False) -> Plate:
    """15 s from 30 degrees, tables 6 and 7."""
    names, t_end = chosen(quick), 1.0 if quick else T_END
    figure = picture("x", "displacement of the box [m]", names, t_end)
    exact = run(EXACT, t_end)["x"]
    numbers = {
        "S x 100, exact dry friction [m]": spread(exact),
        "Smooth from equations by hand, largest difference [m]": distance("x", t_end),
    }
    S, by_steps = dict[str, float](), dict[str, float]()
    apart: dict[str, float] = {}
    for name in names:
        one, printed = run(name, t_end), TABLE_8[name]
        S[name], by_steps[name] = spread(one["x"]), spread(one.at(one.step_times)["x"])
        apart[name] = largest(one["x"] - exact)
        numbers[f"S x 100, {name} [m]"] = S[name]
        numbers[f"S x 100 in table 8, {name} [m]"] = printed
        numbers[f"S x 100 at the steps of the solver, {name} [m]"] = by_steps[name]
        numbers[f"largest distance from exact dry friction, {name} [m]"] = apart[name]
    hinge = Karnopp(mu_s=0.003, mu_d=0.002, D_v=1e-5, form="event")
    finer = replace(box(LAWS["Karnopp"]), hinge=hinge)
    narrow = simulate(finer.model(), t_end, rtol=1e-7, t_eval=run(EXACT, t_end).t)["x"]
    numbers["the same, Karnopp with a hundredth of its band [m]"] = largest(narrow - exact)
    smooth = replace(box(Karnopp()), hinge=replace(hinge, D_v=1e-3, form="smooth"))
    soft = simulate(smooth.model(), t_end, rtol=1e-7, t_eval=run(EXACT, t_end).t)["x"]
    numbers["the same, Karnopp in its smooth form [m]"] = largest(soft - exact)
    wide = apart.pop("Karnopp")
    claims = {
        "a hundredth of its band, or its smooth form, brings Karnopp near": (
            5 * max(largest(narrow - exact), largest(soft - exact)) < wide
        )
    }
    if not quick:
        low, high = min(by_steps, key=lambda name: by_steps[name]), max(by_steps.values())
        claims |= {
            "S is 5.7 ... 5.9 cm every ms for ten laws": all(5.65 < S[n] < 5.95 for n in apart),
            "their boxes lie within 11 mm of dry friction": max(apart.values()) < 0.011,
            "S at the steps is 2.8 ... 7.6 cm, the least Stick-slip's": (
                low == "Stick-slip" and 2.5 < by_steps[low] < high < 8
            ),
            "Karnopp is centimetres off": wide > 0.02,
        }
    far = float(np.median([abs(S[name] / TABLE_8[name] - 1) for name in names]))
    return plate_of(__name__, figure, far, "1", numbers, claims)
