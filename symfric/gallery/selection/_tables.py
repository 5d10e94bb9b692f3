"""The tables once more, as the paper prints them, against what the figures are computed with.

A number that is mistyped in one of both places makes a figure refuse.
"""

from symfric.choice.jing_mi import PRINTED
from symfric.gallery.selection._laws import LAWS
from symfric.scenes import jing_mi

S = {
    "4": "12.7889 11.6026 13.8757 13.9528 13.8141 12.5478 13.4439 15.0088 14.5011 13.3829 14.6707",
    "8": "5.8842 6.4755 6.7982 7.0905 3.7149 7.1542 6.8376 6.2963 3.3126 1.4088 5.3765",
}
"""S(x 10^2) [m] of tables 4 and 8."""
FRICTION = {
    "3": (jing_mi.BELT, "0.1 0.15 1e-3 1e-3 1e5 190 1e-7 1e-6 0.1 | 1e-3 1.5e-3 1e-3 1e-4"),
    "7": (jing_mi.BOX, "0.02 0.03 1e-3 1e-3 1e4 2 1e-7 1e-7 0.01 | 5e-4 0.06 1e-5 1e-6"),
    "7, pendulum": (
        jing_mi.HINGE, "0.002 0.003 1e-3 1e-3 1e4 2 1e-7 1e-7 0.01 | 1e-3 1e-2 1e-5 1e-6"
    ),
}  # fmt: skip
"""Table -> the numbers of the scene, and its rows as printed, in the order of `ROWS`; behind the
bar those of `OURS`, as `scenes.jing_mi` says that it reads them."""
ROWS = (
    "Smooth.mu_d", "Stick-slip.mu_s", "Smooth.v_eps", "LuGre.v_s", "LuGre.sigma_0",
    "LuGre.sigma_1", "Elasto-plastic.z_ba", "Stick-slip.D_max", "Gonthier.tau_dw",
)  # fmt: skip
OURS = ("Velocity-based.v_s", "Velocity-based.v_d", "Gonthier.v_s", "Gonthier.v_d")


def agree(*tables: str) -> dict[str, bool]:
    """Whether the figures are computed with the numbers of these tables."""
    found: dict[str, bool] = {}
    for table in tables:
        if table in S:
            mine = [100 * float(getattr(row, f"S{table}")) for row in PRINTED.values()]
            found[f"S is that of table {table}"] = _same(S[table], mine)
            continue
        numbers, text = FRICTION[table]
        laws = {name: numbers.given(law) for name, law in LAWS.items()}
        mine = [
            float(getattr(laws[name], field))
            for name, _, field in (where.rpartition(".") for where in (*ROWS, *OURS))
        ]
        found[f"the numbers are those of table {table}"] = _same(text.replace("|", ""), mine)
    return found


def _same(text: str, values: list[float]) -> bool:
    return [float(word) for word in text.split()] == [float(f"{v:.9g}") for v in values]
