"""Judge a fit by the residuals that it leaves.

A least-squares fit ends at a minimum whatever model it is given. A right model leaves noise that
has nothing to do with what was applied and how the machine moved; white noise of the size that the
sensor has, if one is lucky. So

* dependence on inputs, speed, direction, place or history makes a fit doubtful: the model is wrong;
* residuals larger than a noise level that was given do, too;
* a signal of which nearly all is left does, even if what is left looks like noise, and so does a
  value at its bound where much is left;
* colour alone does not: intervals carry it, see `covariance`;
* errors in the data, a mass at its bound, or residuals as large as the signal are no physics.

Two limits precede the tests. Below the `resolution` of a measured signal, residuals say nothing of
a model. Bristles are taken as relaxed where a record begins near rest; if the machine was loaded
before, the force is wrong until they have slid once, and stiffness and damping make up for it
(`beginnings`).
"""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from math import inf
from typing import final

import numpy as np

from identification.data.findings import Findings
from identification.residuals.evaluation import Array, Channel
from identification.residuals.sampled import moving_start
from identification.solving.task import Point, Task
from identification.verdict.colour import Colour, Whiteness, whiteness
from identification.verdict.covariance import sandwich
from identification.verdict.independence import Dependence, clues_of, dependences
from identification.verdict.minimum import Minimum, minimum, positions
from symfric.foundation.status import Status

ROUNDING = 1e-6
"""Share of the range of a signal that simulations and interpolation may be off."""
BALANCE = 1e-3
"""The same of a force: filtered and differentiated motions give none that is more exact."""
FORCES = ("N", "N m")


def resolution(measured: Array, unit: str) -> float:
    """Root mean square of the errors of rounding and of simulation, in the unit of the signal.

    A signal is rounded if its values are multiples of the smallest step between two of them.
    """
    values = np.unique(measured)
    reach = float(values[-1] - values[0])
    floor = (BALANCE if unit in FORCES else ROUNDING) * max(
        reach, 1e-3 * float(np.abs(values).max())
    )
    steps = np.diff(values)
    steps = steps[steps > 1e-9 * reach]
    if not steps.size:
        return floor
    count = (values - values[0]) / float(steps.min())
    rounded = np.abs(count - np.rint(count)).max() < 0.1 and values.size < 0.9 * measured.size
    return max(floor, float(steps.min()) / np.sqrt(12)) if rounded else floor


FIRST = 0.05
"""Share of a record that is its beginning."""
FEWEST = 8
"""Samples below which a beginning is none."""
LARGER = 4.0
"""Residuals of a beginning over the others; of Gauss's, coloured or not, 1 in 10 000 have it."""


def beginnings(found: Minimum) -> Iterator[str]:
    """A sentence for each channel whose record begins with what the model does not know.

    Limits: of records in order of time with a velocity among the regressors. A model that is wrong
    at the beginning for another reason, such as a decay from its largest swing, looks the same.
    """
    for channel in found.channels:
        ratio, count = _ratio(found, channel)
        if ratio > LARGER:
            yield (
                f"The residuals of {found.label(channel)} are {ratio:.2g} times as large in its "
                f"first {count} samples as after: the record begins loaded, or with other states "
                "unknown; begin it in sliding, or unloaded."
            )


def _ratio(found: Minimum, channel: Channel) -> tuple[float, int]:
    """Size of the residuals at the beginning over that of the others, and samples of it."""
    v, r = channel.regressors.get("v"), found.r[channel.rows]
    count = int(FIRST * r.size)
    if v is None or not channel.ordered or count < FEWEST or moving_start(v) != 0.0:
        return 0.0, count
    first, later = (float(np.sqrt(np.mean(part**2))) for part in (r[:count], r[count:]))
    return first / max(later, 1e-300), count


ALARM = 0.02
"""Chance of a false alarm over all tests of a fit."""
WHITE = 0.05
"""Level of the test for white noise of one channel, which decides nothing."""
SHARE = 0.05
"""Share of the variance of the residuals from which on a dependence counts."""
SMOOTHED = 5e-3
"""Share of the range of a signal that the smoothing of an acceleration may leave of its own."""
UNEXPLAINED = 0.7
"""Residuals over the spread of the signal from which on a model says next to nothing."""
LITTLE = 0.9
"""Residuals over the spread of the signal from which on a fit rests on a fifth of its variance."""
CHANCE = 10.0
"""What a model explains, over what as many free numbers explain of noise, that is no chance."""
INERTIA = ("kg", "kg m^2")
NEARLY = 0.1
"""Share of the cost that a step may still gain of an unfinished search whose residuals fail tests:
they do not fail them for want of that step."""


@final
@dataclass(frozen=True, eq=False)
class Test:
    """One question to the residuals.

    Attributes:
        channel: signal, with the number of its record where there are several: "force[2]".
        name: "whiteness", "independence of ...", "size", "explained", "bound".
        statistic, p: of the test, and the chance of a larger statistic if the model is right.
        limit: p below which the test fails; for `size` and `explained` that of the statistic.
        passed: whether it did not fail.
        decides: whether failing makes the fit doubtful.
        sentence: what was found.
    """

    __test__ = False  # not one of pytest

    channel: str
    name: str
    statistic: float
    p: float
    limit: float
    passed: bool
    decides: bool
    sentence: str


@final
@dataclass(frozen=True, eq=False)
class Verdict:
    """What the residuals say of a fit.

    Attributes:
        tests: all that was asked.
        effective: number of independent samples of each channel.
        whiteness: autocorrelations of each channel with their limits, for a plot over lags.
        nonsense: why the result is no physics; empty if it may be.
        sentences: what a reader has to know, worst first.
    """

    tests: tuple[Test, ...]
    effective: dict[str, float]
    whiteness: dict[str, Whiteness]
    nonsense: tuple[str, ...] = ()
    sentences: tuple[str, ...] = field(default=())

    @property
    def good(self) -> bool:
        """Whether nothing speaks against the model."""
        return not self.nonsense and all(t.passed for t in self.tests if t.decides)

    def status(self, solved: Status, gain: float = inf) -> Status:
        """How the fit ended, if the solver ended so.

        Args:
            solved: of the solver.
            gain: share of the cost that a step promises where the solver ran out of evaluations. Of
                little, a model that fails its tests is doubtful as one at a minimum; one that
                passes them, or far from a minimum, is unfinished and nothing else.
        """
        if self.good:
            return solved
        if solved is Status.MAX_ITERATIONS and gain < NEARLY and not self.nonsense:
            return Status.DOUBTFUL
        if not solved.ok:
            return solved
        return Status.IMPLAUSIBLE if self.nonsense else Status.DOUBTFUL


def judge(task: Task, point: Point, findings: Findings | None = None) -> Verdict:
    """The verdict on a solved task; errors that were found in its data make it no physics."""
    return judged(minimum(task, point), findings)


def judged(found: Minimum, findings: Findings | None = None) -> Verdict:
    """The verdict on a minimum."""
    inside = sandwich(found)
    white = dict[str, Whiteness]()
    tests, effective = list[Test](), dict[str, float]()
    every = list[tuple[Channel, list[Dependence]]]()
    for channel, colour in zip(found.channels, inside.colours, strict=True):
        name = found.label(channel)
        effective[name] = colour.effective
        position = positions(channel)
        r = found.r[channel.rows]
        J = (found.J * ~found.held * found.gain[:, None])[channel.rows]
        white[name] = whiteness(r, J, position)
        tests.append(_white(name, white[name], colour))
        every.append((channel, list(dependences(r, J, colour, clues_of(found, channel), position))))
        tests += _size(found, channel, colour)
    count = sum(len(some) for _, some in every)
    for channel, some in every:
        tests += _independent(found, channel, some, ALARM / max(count, 1))
    tests += _explained(found)
    errors = () if findings is None else tuple(e.sentence for e in findings.errors)
    nonsense = (*errors, *_unexplained(found, effective), *_no_mass(found))
    bounds = tuple(_bounds(found))
    failed = [t for t in tests if not t.passed]
    failed.sort(key=lambda t: (not t.decides, t.p))
    said = (*nonsense, *beginnings(found), *(t.sentence for t in failed), *bounds)
    return Verdict(tuple(tests), effective, white, nonsense, said)


def _white(name: str, found: Whiteness, colour: Colour) -> Test:
    if not found.lags.size:
        text = f"{name}: not ordered in time."
        return Test(name, "whiteness", 0.0, 1.0, WHITE, True, False, text)
    passed = found.p >= WHITE
    text = f"The residuals of {name} look like white noise."
    if not passed:
        k = int(np.argmax(np.abs(found.correlation)))
        most = f"correlation {found.correlation[k]:.2f} over {found.lags[k]:.0f} samples"
        text = f"The residuals of {name} are not white ({most})"
        text += (
            f": {colour.rows} of them count as {colour.effective:.0f}; the intervals allow for it."
            if colour.order
            else ", too little to matter for the intervals."
        )
    return Test(name, "whiteness", found.statistic, found.p, WHITE, passed, False, text)


def _independent(
    found: Minimum, channel: Channel, some: list[Dependence], limit: float
) -> Iterator[Test]:
    """One test a family; what cannot be told from rounding or is a small share does not count."""
    name, unit = found.label(channel), channel.unit
    fine = resolution(channel.measured, channel.unit)
    level = _level(found, channel)
    for d in some:
        size = d.size * level
        least = SMOOTHED * float(np.ptp(channel.measured)) if d.smoothed else fine
        passed = d.p >= limit or size <= least or d.share < SHARE
        text = (
            f"The residuals of {name} depend on {d.what}: {size:.2g} {unit} of them, "
            f"{100 * min(d.share, 1.0):.0f} % of their variance ({d.hint})."
        )
        if passed:
            text = f"The residuals of {name} do not depend on {d.what}."
        test = f"independence of {d.what}"
        yield Test(name, test, d.statistic, d.p, limit, passed, True, text)


def _level(found: Minimum, channel: Channel) -> float:
    """Unit of the signal over that of the weighted residuals."""
    raw, r = found.raw[channel.rows], found.r[channel.rows]
    size = float(np.linalg.norm(r))
    return float(np.linalg.norm(raw)) / size if size > 0 else 1.0


def _size(found: Minimum, channel: Channel, colour: Colour) -> Iterator[Test]:
    """Residuals against a noise level that is known: chi2 with the effective number of samples.

    Outliers count as much as the loss lets them: it was chosen because they are there.
    """
    from scipy.special import chdtrc  # noqa: PLC0415  (SciPy is loaded by those who fit)

    sigma = found.noise.get(channel.signal)
    if sigma is None:
        return
    name = found.label(channel)
    robust = bool((found.gain[channel.rows] != 1.0).any())
    left = sigma * found.r[channel.rows] if robust else found.raw[channel.rows]
    rms = float(np.sqrt(np.mean(left**2)))
    free = max(colour.effective * colour.freedom / colour.rows, 1.0)
    p = float(chdtrc(free, free * (rms / sigma) ** 2))
    limit = ALARM / len(found.channels)
    passed = p >= limit or rms <= resolution(channel.measured, channel.unit)
    text = (
        f"The residuals of {name} are {rms:.2g} {channel.unit}, {rms / sigma:.2g} times the noise "
        f"that was given."
    )
    yield Test(name, "size", rms / sigma, p, limit, passed, True, text)


def _left(found: Minimum) -> Iterator[tuple[str, float, float]]:
    """Signal, sum of the squares of its residuals, and of what it deviates from its mean."""
    for signal in dict.fromkeys(c.signal for c in found.channels):
        some = [c for c in found.channels if c.signal == signal]
        left = sum(float(np.sum(found.raw[c.rows] ** 2)) for c in some)
        yield signal, left, sum(float(np.sum((c.measured - c.measured.mean()) ** 2)) for c in some)


def _explained(found: Minimum) -> Iterator[Test]:
    """Whether a fit rests on enough of a signal: on all but its noise, or on a little beside it."""
    at = _at_bound(found)
    for signal, left, there in _left(found):
        share = float(np.sqrt(left / there)) if there > 0 else 0.0
        limit = UNEXPLAINED if at else LITTLE
        bound = f" and {', '.join(at)} at a bound" if at else ""
        text = (
            f"The model leaves {100 * share:.3g} % of {signal} unexplained{bound}: take another "
            f"model, or, if {signal} is mostly noise or chatter, a lower cut-off with as many "
            "samples an equation as it allows, InverseDynamics(filter=Filter(10.0, decimation=10))."
        )
        yield Test(signal, "explained", share, 0.0, limit, share < limit, True, text)


def _unexplained(found: Minimum, effective: Mapping[str, float]) -> Iterator[str]:
    """Signals of which a model leaves nearly everything.

    Of a signal that is mostly noise a right model leaves much; but what it explains is many times
    the share k / n_eff that any k numbers explain of n_eff independent samples.
    """
    for signal, left, there in _left(found):
        some = [c for c in found.channels if c.signal == signal]
        by_chance = (~found.held).sum() / sum(effective[found.label(c)] for c in some)
        if not there > 0 or left <= UNEXPLAINED**2 * there:
            continue
        if 1 - left / there < CHANCE * by_chance:
            yield (
                f"The model leaves {100 * np.sqrt(left / there):.0f} % of {signal} unexplained: "
                "another model, another column, another sign or another unit is needed."
            )


def _no_mass(found: Minimum) -> Iterator[str]:
    for unknown, held in zip(found.unknowns, found.held, strict=True):
        value = found.values[found.names.index(unknown.name)]
        near = value <= unknown.lower + 1e-3 * max(abs(unknown.start), abs(unknown.lower))
        if held and unknown.unit in INERTIA and near:
            yield (
                f"{unknown.name} is at its lower bound, {value:.3g} {unknown.unit}: the force has "
                "nothing to do with the acceleration, or one of them has the wrong sign."
            )


def _at_bound(found: Minimum) -> list[str]:
    both = zip(found.unknowns, found.held, strict=True)
    return [u.name for u, held in both if held and not u.nuisance]


def _bounds(found: Minimum) -> Iterator[str]:
    at = _at_bound(found)
    if at:
        yield f"At a bound: {', '.join(at)}."
