"""Calibration of the verdicts and intervals of fits over a bank of scenes."""

from collections import Counter
from collections.abc import Iterator, Sequence
from functools import partial
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from symfric.bench.identification_scenes import SCENES, Scene
from symfric.bench.report import Found, Row, goal, timed
from symfric.foundation.status import Status

if TYPE_CHECKING:
    from matplotlib.figure import Figure

SEEDS, EVERY = 50, 6
"""Number of seeds; quick runs fit every sixth scene once, without goals."""
TITLE = "Verdicts and coverage of 95 % intervals"
INSIDE = (0.90, 0.99)
"""Range of the coverage of the intervals of fits that are called solved."""
ENOUGH = 10
"""Smallest number of intervals whose coverage counts."""
RIGHT, WRONG = 0.90, 0.05
"""Smallest share of right models, and largest share of wrong models, that are called solved."""
WIDTH = 1.96
"""Standard errors of a measured coverage within which it agrees with the range."""


class Count(NamedTuple):
    """Statuses of the fits of a scene, and coverage of the intervals of the solved ones.

    Attributes:
        scene: the scene.
        statuses: name of a status -> number of fits.
        covered: parameter -> intervals that contain the truth, and number of intervals.
    """

    scene: Scene
    statuses: Counter[str]
    covered: dict[str, tuple[int, int]]

    @property
    def solved(self) -> float:
        """Share of the fits that are called solved."""
        return self.statuses[Status.SOLVED.name] / self.statuses.total()

    def off(self) -> Iterator[tuple[str, float]]:
        """Yield each parameter whose coverage is significantly outside the range."""
        low, high = INSIDE
        for name, (inside, n) in self.covered.items():
            if n >= ENOUGH:
                below, above = (WIDTH * np.sqrt(p * (1 - p) / n) for p in INSIDE)
                share = inside / n
                if share < low - below or share > high + above:
                    yield name, share


def counted(scene: Scene, seeds: Sequence[int]) -> Count:
    """Fit a scene with each of `seeds`."""
    statuses, covered = Counter[str](), dict[str, tuple[int, int]]()
    number = SCENES.index(scene)
    for seed in seeds:
        found = scene.fit(np.random.default_rng([seed, number])).solve(throw=False)
        statuses[found.status.name] += 1
        for name, true in scene.truth.items():
            e = found.parameters[name]
            if found.status is Status.SOLVED and e.low is not None and e.high is not None:
                inside, n = covered.get(name, (0, 0))
                covered[name] = inside + (e.low <= true <= e.high), n + 1
    return Count(scene, statuses, covered)


def verdicts(quick: bool) -> Iterator[Found]:
    """Measure verdicts and coverage over the bank of `identification_scenes`.

    Goals: the coverage of the 95 % intervals of all parameters of fits called solved is between
    .90 and .99 (within the error of the measured coverage), right models are called solved in 90 %,
    wrong ones in at most 5 %.
    """
    all_of, spent = list[Count](), 0.0
    for scene in SCENES[:: EVERY if quick else 1]:
        seconds, count = timed(partial(counted, scene, range(1 if quick else SEEDS)))
        all_of.append(count)
        spent += seconds
        yield TITLE, _row(count)
    if quick:
        return
    kinds = {k: [c for c in all_of if c.scene.kind == k] for k in ("right", "record", "wrong")}
    lost = [c for c in kinds["right"] if c.solved < RIGHT]
    what, note = "scenes of right models solved in less than 90 %", _names(lost)
    yield goal(what, len(lost), 0, "<=", spent, note)
    lost = [c for c in kinds["wrong"] if c.solved > WRONG]
    yield goal("scenes of wrong models solved in more than 5 %", len(lost), 0, note=_names(lost))
    off = [f"{c.scene.name}: {n} {x:.2f}" for c in all_of for n, x in c.off()]
    yield goal("coverages outside .90 ... .99", len(off), 0, note="; ".join(off))


def _names(counts: Sequence[Count]) -> str:
    return ", ".join(f"{c.scene.name} {c.solved:.2f}" for c in counts)


def _row(count: Count) -> Row:
    """Return the table row of a scene."""
    shares = [inside / n for inside, n in count.covered.values()]
    each = ", ".join(f"{n} {i}/{k}" for n, (i, k) in count.covered.items())
    others = count.statuses.total() - count.statuses["SOLVED"] - count.statuses["DOUBTFUL"]
    return {
        "scene": count.scene.name, "kind": count.scene.kind + " (kept)" * count.scene.kept,
        "fits": float(count.statuses.total()), "solved": float(count.statuses["SOLVED"]),
        "doubtful": float(count.statuses["DOUBTFUL"]), "others": float(others),
        "least coverage": min(shares, default=float("nan")), "intervals with the truth": each,
    }  # fmt: skip


def draw(rows: Sequence[Row]) -> "Figure":
    """Draw the shares of solved fits, and the coverage over all parameters among them."""
    from symfric.foundation.panels import grid  # noqa: PLC0415  (slow to import)
    from symfric.foundation.style import colour  # noqa: PLC0415  (slow to import)

    figure, ((left, right),) = grid(1, 2, 10.0, 1.5 + 0.22 * len(rows), sharey=True)
    kinds = list(dict.fromkeys(str(row["kind"]).split()[0] for row in rows))
    for y, row in enumerate(rows):
        shade = colour(kinds.index(str(row["kind"]).split()[0]))
        left.barh(y, float(row["solved"]) / float(row["fits"]), color=shade)
        cells = str(row["intervals with the truth"])
        pairs = [cell.rsplit(" ", 1)[1].split("/") for cell in cells.split(", ") if cell]
        inside, n = (sum(int(pair[k]) for pair in pairs) for k in (0, 1))
        if n >= ENOUGH:
            right.plot(inside / n, y, "o", ms=4, color=shade)
    left.set_yticks(range(len(rows)), [str(row["scene"]) for row in rows], fontsize="x-small")
    left.invert_yaxis()
    left.set_xlabel("share of fits called solved")
    right.axvspan(*INSIDE, alpha=0.15)
    right.set_xlabel("coverage of 95 % intervals of solved fits")
    for k, kind in enumerate(kinds):
        left.barh([0], [0], color=colour(k), label=kind)
    left.legend(fontsize="small")
    return figure
