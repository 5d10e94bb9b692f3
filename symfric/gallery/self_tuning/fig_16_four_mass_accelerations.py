"""Accelerations of the four masses.

Compared: both laws, each with the same machine in two coordinates, written by hand and solved by
SUNDIALS; and by their total variation, what jitter adds to, for peaks from 20 to 1 mm/s.

Distance: largest difference of an acceleration from that by hand, both laws.

Reproduced: the self-tuning law gives smooth signals, whatever its B from 0.1 to 1 s/mm, its own
among them.

Refuted: that Brown-McPhee jitters by itself: with error control the total variation of both is the
same within 3 %, and between peaks at 20 and 1 mm/s it changes by less than 5 %. Figure 13 shows
where jitter comes from.
"""

from symfric.gallery.plate import Plate, plate_of
from symfric.gallery.self_tuning._runs_four_mass import (
    B_RANGE,
    LAWS,
    PEAK,
    TUNED,
    apart,
    distance,
    picture,
    run,
    variation,
)


def plate(quick: bool = False) -> Plate:
    """4 s from the start of Haug's example."""
    t_end = 0.4 if quick else 4.0
    numbers = {f"laws apart, {slider} [m/s^2]": d for slider, d in apart("''", t_end).items()}
    totals: dict[str, list[float]] = {law: [] for law in LAWS}
    for v_t in (0.01,) if quick else (0.02, 0.01, 0.005, 0.002, 0.001):
        for law in LAWS:
            total = variation(run(law, v_t, t_end)["x1''"])
            numbers[f"total variation of x1'', {law}, {1e3 * v_t:g} mm/s [m/s^2]"] = total
            totals[law].append(total)
    own = variation(run(TUNED, 0.01, t_end)["x1''"])
    numbers[f"total variation of x1'', {TUNED} [m/s^2]"] = own
    claims = {
        "the total variations of both laws are the same within 3 %": all(
            abs(one / other - 1) < 0.03 for one, other in zip(*totals.values(), strict=True)
        ),
        "each changes by less than 5 % with the velocity of the peak": all(
            max(each) / min(each) < 1.05 for each in totals.values()
        ),
    }
    if not quick:
        swept = [variation(run(LAWS[0], PEAK / B, t_end)["x1''"]) for B in B_RANGE]
        claims["so it is with every B of figure 8, and with its own"] = all(
            abs(total / totals[LAWS[1]][1] - 1) < 0.05 for total in (*swept, own)
        )
    figure = picture("''", "acceleration [m/s²]", t_end)
    far, within = distance("''", t_end), 4e-8 if quick else 4e-5
    return plate_of(__name__, figure, far, "m/s^2", numbers, claims, within=within, quick=quick)
