"""Eleven laws of the paper, in its order and with its names, and their printed numbers.

A figure fails if a number here or in a scene differs from the printed one.
"""

from collections.abc import Mapping
from math import inf
from typing import Any

from matplotlib.axes import Axes
from matplotlib.figure import Figure

from symfric import Awrejcewicz, BengisuAkay, Karnopp, Law, Threlfall, VelocityBased
from symfric.foundation.numeric import Array
from symfric.foundation.panels import grid
from symfric.foundation.style import colour
from symfric.gallery.selection.tables import PRINTED
from symfric.gallery.shared import REFERENCE, rms
from symfric.scenes import PendulumBox, Rabinowicz

LAWS: dict[str, Law] = {name: row.law() for name, row in PRINTED.items()}
LAWS["Karnopp"] = Karnopp(form="event")
"""Laws with the numbers of the library; presets replace them by those of the paper."""
ORIGINAL: dict[str, Law] = {
    "Threlfall": Threlfall(form="original"),
    "Bengisu": BengisuAkay(form="original"),
    "Velocity-based": VelocityBased(form="original"),
    "Awrejcewicz": Awrejcewicz(form="original"),
}
"""Published, piecewise forms of laws that are smooth in `LAWS`."""
BEHIND: dict[str, Any] = {**REFERENCE, "linewidth": 2.4}
DOTTED: dict[str, Any] = {"color": "k", "linestyle": ":", "linewidth": 0.9}
QUICK = ("Smooth", "Karnopp", "LuGre")
"""Laws that represent all laws at reduced size."""
SLIDING = ("Smooth", "Threlfall", "Dahl")
"""Laws without a static level."""
BRISTLES = ("LuGre", "Elasto-plastic", "Stick-slip", "Gonthier")
"""Laws with a static level and states."""

TABLE_4 = {name: 100 * row.S4 for name, row in PRINTED.items()}
"""Printed S x 100 [m] of the block on the belt."""
TABLE_8 = {name: 100 * row.S8 for name, row in PRINTED.items()}
"""Printed S x 100 [m] of the box."""


FORMS = LAWS | {f"{name}, original": law for name, law in ORIGINAL.items()}
"""Every law in every form that is drawn."""


def law_of(name: str) -> str:
    """Return the law of which `name` is a form."""
    return name.partition(",")[0]


def forms(names: tuple[str, ...]) -> tuple[str, ...]:
    """Return these laws and their original forms, where they exist."""
    return (*names, *(name for name in FORMS if name not in LAWS and law_of(name) in names))


def chosen(quick: bool) -> tuple[str, ...]:
    """Return the names of the laws of a figure."""
    return QUICK if quick else tuple(LAWS)


def small_multiples(
    curves: Mapping[str, tuple[Array, Array]],
    reference: tuple[Array, Array],
    label: str,
    low: float = -inf,
    high: float = inf,
) -> Figure:
    """Return a picture with a panel per law, and exact dry friction behind each law.

    Colours show the kinds of laws. Next to the name of a law is its root mean square distance from
    exact dry friction; the original form of a law that is smooth here is dotted.
    """
    unit = label[label.index("[") + 1 : -1]
    dotted = {law_of(name): curve for name, curve in curves.items() if name not in LAWS}
    curves = {name: curve for name, curve in curves.items() if name in LAWS}
    columns = 3 if len(curves) > 3 else 2
    rows = -(-(len(curves) + 1) // columns)
    figure, axes = grid(rows, columns, height=0.9 + 1.45 * rows, sharex=True, sharey=True)
    places = [axis for row in axes for axis in row]
    for axis, (name, (t, y)) in zip(places, curves.items(), strict=False):
        axis.plot(*reference, **BEHIND)
        axis.plot(t, y, color=colour(kind(name)), linewidth=1.1)
        if name in dotted:
            axis.plot(*dotted[name], **DOTTED)
        axis.set_title(name, fontsize="medium", loc="left", pad=3)
        off = rms(y - reference[1])
        axis.set_title(
            f"rms {off:.2g} {unit}", fontsize="x-small", loc="right", pad=3, color="0.35"
        )
    if low > -inf:
        places[0].set_ylim(low, high)
    for axis in places[len(curves) :]:
        axis.axis("off")
    for axis in places[len(curves) - columns : len(curves)]:  # these panels have none below them
        axis.tick_params(labelbottom=True)
    _legend(places[len(curves)], bool(dotted))
    figure.supxlabel("time [s]", fontsize="medium")
    figure.supylabel(label, fontsize="medium")
    return figure


def kind(name: str) -> int:
    """Return 0 without a static level, 1 with static level only, 2 with static level and states."""
    return 0 if name in SLIDING else 2 if name in BRISTLES else 1


def _legend(axis: Axes, originals: bool) -> None:
    axis.plot([], [], label="exact dry friction", **BEHIND)
    if originals:
        axis.plot([], [], label="original form", **DOTTED)
    for k, text in enumerate(("no static level", "static level", "static level, states")):
        axis.plot([], [], color=colour(k), label=text)
    axis.legend(loc="center", frameon=False, fontsize="small")


PRINTED_S = {
    "4": "12.7889 11.6026 13.8757 13.9528 13.8141 12.5478 13.4439 15.0088 14.5011 13.3829 14.6707",
    "8": "5.8842 6.4755 6.7982 7.0905 3.7149 7.1542 6.8376 6.2963 3.3126 1.4088 5.3765",
}
"""S(x 10^2) [m] of tables 4 and 8."""
_BELT = Rabinowicz.presets["jing_mi_table_3"].friction["law"]
_BOX = PendulumBox.presets["jing_mi_table_7"].friction
PRINTED_NUMBERS = {
    "3": (_BELT, "0.1 0.15 1e-3 1e-3 1e5 190 1e-7 1e-6 0.1 | 1e-3 1.5e-3 1e-3 1e-4"),
    "7": (_BOX["law"], "0.02 0.03 1e-3 1e-3 1e4 2 1e-7 1e-7 0.01 | 5e-4 0.06 1e-5 1e-6"),
    "7, pendulum": (
        _BOX["hinge"], "0.002 0.003 1e-3 1e-3 1e4 2 1e-7 1e-7 0.01 | 1e-3 1e-2 1e-5 1e-6"
    ),
}  # fmt: skip
"""Table -> numbers of the scene, and rows as printed, in the order of `ROWS`; after the bar the
rows of `OURS`, as presets.toml of the scenes interprets the table."""
ROWS = (
    "Smooth.mu_d", "Stick-slip.mu_s", "Smooth.v_eps", "LuGre.v_s", "LuGre.sigma_0",
    "LuGre.sigma_1", "Elasto-plastic.z_ba", "Stick-slip.D_max", "Gonthier.tau_dw",
)  # fmt: skip
OURS = ("Velocity-based.v_s", "Velocity-based.v_d", "Gonthier.v_s", "Gonthier.v_d")


def agree(*tables: str) -> dict[str, bool]:
    """Return claims that the figures are computed with the numbers of these tables."""
    found: dict[str, bool] = {}
    for table in tables:
        if table in PRINTED_S:
            mine = [100 * float(getattr(row, f"S{table}")) for row in PRINTED.values()]
            found[f"S is that of table {table}"] = _same(PRINTED_S[table], mine)
            continue
        numbers, text = PRINTED_NUMBERS[table]
        laws = {name: numbers.given(law) for name, law in LAWS.items()}
        mine = [
            float(getattr(laws[name], field))
            for name, _, field in (where.rpartition(".") for where in (*ROWS, *OURS))
        ]
        found[f"the numbers are those of table {table}"] = _same(text.replace("|", ""), mine)
    return found


def _same(text: str, values: list[float]) -> bool:
    return [float(word) for word in text.split()] == [float(f"{v:.9g}") for v in values]
