"""Assessment of a fit by its residuals.

A least-squares fit reaches a minimum for any model. The residuals of a correct model are noise that
is independent of inputs and motion, ideally white noise with the size of the sensor noise.
Therefore

* dependence on inputs, speed, direction, position, time or history makes a fit doubtful, because
  the model is wrong;
* residuals larger than a given noise level make it doubtful;
* autocorrelated residuals that are worth few independent samples, values at bounds of the search,
  and friction far beyond the measured forces make it doubtful;
* a signal that is almost entirely unexplained makes it doubtful, even if its residuals look like
  noise; so does a value at its bound if much is unexplained;
* other autocorrelation does not, because the intervals account for it, see `covariance`;
* errors in the data, a mass at its bound, or residuals as large as the signal make a result
  implausible.

Limits: residuals below the `resolution` of a measured signal carry no information. A measured
motion shares its noise with the residuals of inverse dynamics. A dependence on present and past
velocities or accelerations that is not larger than this noise is ignored, and so is an error of the
model of that size.
"""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from math import inf
from typing import final

import numpy as np

from identification.data.findings import Findings
from identification.residuals.evaluation import Channel
from identification.verdict.colour import Colour, Whiteness, positions, span, whiteness
from identification.verdict.covariance import FAR, Levels
from identification.verdict.independence import (
    FORCES,
    Dependence,
    DependenceTest,
    dependences,
    inputs_of,
    resolution,
    rms,
)
from identification.verdict.minimum import Minimum
from symfric.foundation.status import Status

ALARM = 0.02
"""Probability of a false alarm over all tests of a fit."""
WHITE = 0.05
"""Level of the test of one channel for white noise, which does not affect the verdict."""
SHARE = 0.05
"""Share of the variance of the residuals below which a dependence is ignored."""
MOVED = 2.0
"""Change of the fitted values by a missing term, in standard errors, below which it is ignored."""
SMOOTHED = 1e-3
"""Size of an ignored dependence on a smoothed acceleration, relative to the range of a signal."""
NOISY = 1.25
"""Size of an ignored dependence on past measured motion, relative to that of its noise."""
UNEXPLAINED = 0.7
"""Ratio of residuals to the spread of the signal above which a model explains almost nothing."""
LITTLE = 0.9
"""The same ratio without a value at a bound; the fit then explains a fifth of the variance."""
CHANCE = 10.0
"""Smallest ratio of the explained variance to that of as many regressors of pure noise."""
FEW = 6.0
"""Effective samples per unknown below which a fit is doubtful.

With fewer, an autocorrelation that happens to be estimated too small halves the intervals.
"""
SCORE = 3.84
"""Score of a bound above which a value at the bound matters, chi2 with 5 %."""
INERTIA = ("kg", "kg m^2")
NEARLY = 0.1
"""Predicted gain of an unfinished search, relative to the cost, below which tests are valid."""


@final
@dataclass(frozen=True, eq=False)
class Test:
    """Result of one test of the residuals.

    Attributes:
        channel: signal, with the index of its record if there are several: "force[2]".
        name: "whiteness", "independence of ...", "size", "explained", "effective samples",
            "bound", "extrapolation".
        statistic, p: statistic, and the probability of a larger one if the model is correct.
        limit: p below which the test fails; for `size` and `explained` the limit of the statistic.
        passed: True unless the test failed.
        decides: True if failing makes the fit doubtful.
        sentence: result as a sentence.
    """

    __test__ = False  # this class is no test for pytest

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
    """Assessment of a fit by its residuals.

    Attributes:
        tests: all tests.
        effective: channel -> number of independent samples.
        whiteness: channel -> autocorrelations and their limits, for a plot over lags.
        nonsense: reasons why the result is physically implausible; empty without such reasons.
        sentences: messages for the user in order of decreasing severity.
    """

    tests: tuple[Test, ...]
    effective: dict[str, float]
    whiteness: dict[str, Whiteness]
    nonsense: tuple[str, ...] = ()
    sentences: tuple[str, ...] = field(default=())

    @property
    def good(self) -> bool:
        """True if no test speaks against the model."""
        return not self.nonsense and all(t.passed for t in self.tests if t.decides)

    def status(self, solved: Status, gain: float = inf) -> Status:
        """Return the status of the fit, given that of the solver.

        Args:
            solved: status of the solver.
            gain: predicted gain of a further step relative to the cost, if the solver ran out of
                evaluations. If the gain is small, a model that fails its tests is doubtful, as at
                a minimum. If it is large, or if the tests pass, the fit is unfinished.
        """
        if self.good:
            return solved
        if solved is Status.MAX_ITERATIONS and gain < NEARLY and not self.nonsense:
            return Status.DOUBTFUL
        if not solved.ok:
            return solved
        return Status.IMPLAUSIBLE if self.nonsense else Status.DOUBTFUL


def judge(
    found: Minimum, findings: Findings | None = None, levels: Levels | None = None
) -> Verdict:
    """Assess a minimum.

    Args:
        found: the minimum.
        findings: findings in the data; errors make the result implausible.
        levels: forces of the law and of the data, if known.
    """
    white = dict[str, Whiteness]()
    tests, effective = list[Test](), dict[str, float]()
    each = list[tuple[Channel, list[tuple[DependenceTest, Dependence]]]]()
    for channel, colour in zip(found.channels, found.colours, strict=True):
        name = found.label(channel)
        effective[name] = colour.effective
        position = positions(channel)
        r = found.r[channel.rows]
        J = (found.J * ~found.held * found.gain[:, None])[channel.rows]
        white[name] = whiteness(r, J, position)
        tests.append(_white(name, white[name], colour))
        each.append((channel, list(dependences(r, J, colour, inputs_of(found, channel), position))))
        tests += _size(found, channel, colour)
    count = sum(len(some) for _, some in each)
    for channel, some in each:
        tests += _independent(found, channel, some, ALARM / max(count, 1))
    tests += [*_explained(found), *_few(found, effective), *_box(found)]
    tests += _extrapolated(levels) if levels is not None else []
    errors = () if findings is None else tuple(e.sentence for e in findings.errors)
    nonsense = (*errors, *_unexplained(found, effective), *_no_mass(found))
    at = [name for name in _at_bound(found) if name not in _at_box(found)]
    bounds = [f"Values at a bound: {', '.join(at)}."] if at else []
    failed = [t for t in tests if not t.passed]
    failed.sort(key=lambda t: (not t.decides, t.p))
    messages = (*nonsense, *(t.sentence for t in failed), *bounds)
    return Verdict(tuple(tests), effective, white, nonsense, messages)


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
            f": {colour.rows} count as {colour.effective:.0f} independent ones in the intervals."
            if round(colour.effective) < colour.rows
            else ", too little to matter for the intervals."
        )
    return Test(name, "whiteness", found.statistic, found.p, WHITE, passed, False, text)


def _independent(
    found: Minimum, channel: Channel, some: list[tuple[DependenceTest, Dependence]], limit: float
) -> Iterator[Test]:
    """Yield one test for each family; effects below the resolution or with a small share pass."""
    name, unit, r = found.label(channel), channel.unit, found.r[channel.rows]
    fine, weighted = resolution(channel.measured, channel.unit), float(np.linalg.norm(r))
    level = float(np.linalg.norm(found.raw[channel.rows])) / weighted if weighted > 0 else 1.0
    for family, (statistic, p, explained, moved) in some:
        size, share = explained * level, explained**2 / (float(r @ r) / r.size)
        least = SMOOTHED * float(np.ptp(channel.measured)) if family.smoothed else fine
        least = max(least, NOISY * channel.motion_noise) if family.noisy else least
        passed = p >= limit or size <= least or (share < SHARE and moved < MOVED)
        part = f"{100 * min(share, 1.0):.0f} %" if share >= 0.01 else "less than 1 %"
        text = (
            f"The residuals of {name} depend on {family.what}: {size:.2g} {unit} rms, "
            f"{part} of their variance ({family.hint})."
        )
        if passed:
            text = f"The residuals of {name} do not depend on {family.what}."
        test = f"independence of {family.what}"
        yield Test(name, test, statistic, p, limit, passed, True, text)


def _size(found: Minimum, channel: Channel, colour: Colour) -> Iterator[Test]:
    """Compare residuals with a given noise level by chi2 with the effective number of samples.

    With a robust loss, outliers have their reduced weight.
    """
    from scipy.special import chdtrc  # noqa: PLC0415  (slow to import)

    sigma = found.noise.get(channel.signal)
    if sigma is None:
        return
    name = found.label(channel)
    robust = bool((found.gain[channel.rows] != 1.0).any())
    left = sigma * found.r[channel.rows] if robust else found.raw[channel.rows]
    size = rms(left)
    free = max(colour.effective * colour.freedom / colour.rows, 1.0)
    p = float(chdtrc(free, free * (size / sigma) ** 2))
    limit = ALARM / len(found.channels)
    passed = p >= limit or size <= resolution(channel.measured, channel.unit)
    text = (
        f"The residuals of {name} are {size:.2g} {channel.unit}, {size / sigma:.2g} times the "
        f"given noise level."
    )
    yield Test(name, "size", size / sigma, p, limit, passed, True, text)


def _left(found: Minimum) -> Iterator[tuple[str, float, float]]:
    """Yield each signal with the sums of squares of its residuals and of the centred signal.

    A force is centred over all records, because each may be at a constant speed; other signals are
    centred in each record, because records may be at different places.
    """
    for signal in dict.fromkeys(c.signal for c in found.channels):
        some = [c for c in found.channels if c.signal == signal]
        left = sum(float(np.sum(found.raw[c.rows] ** 2)) for c in some)
        parts = [c.measured for c in some]
        if some[0].unit in FORCES:
            parts = [np.concatenate(parts)]
        yield signal, left, sum(part.size * float(np.var(part)) for part in parts)


def _explained(found: Minimum) -> Iterator[Test]:
    """Test whether the model explains enough of each signal."""
    at = _at_bound(found)
    for signal, left, there in _left(found):
        share = float(np.sqrt(left / there)) if there > 0 else 0.0
        limit = UNEXPLAINED if at else LITTLE
        bound = f" and {', '.join(at)} at a bound" if at else ""
        text = (
            f"The model leaves {100 * share:.3g} % of {signal} unexplained{bound}: use another "
            f"model, or, if {signal} is mostly noise or chatter, a lower cut-off with as many "
            "samples per equation as allowed, InverseDynamics(filter=Filter(10.0, decimation=10))."
        )
        yield Test(signal, "explained", share, 0.0, limit, share < limit, True, text)


def _few(found: Minimum, effective: Mapping[str, float]) -> Iterator[Test]:
    """Test whether the residuals are worth enough independent samples for the unknowns.

    Fewer samples determine neither the intervals nor whether the residuals are noise at all: slow
    model errors and slow noise look alike.
    """
    n, count = int((~found.held).sum()), sum(effective.values())
    exact = all(rms(found.raw[c.rows]) <= resolution(c.measured, c.unit) for c in found.channels)
    if not n or exact or count >= sum(c.t.size for c in found.channels):
        return
    text = (
        f"The autocorrelated residuals are worth only {count:.0f} independent samples for {n} "
        "unknowns: they may be a model error, and the intervals may be too small; record longer."
    )
    share = count / n
    yield Test("all", "effective samples", share, 0.0, FEW, share >= FEW, True, text)


def _box(found: Minimum) -> Iterator[Test]:
    """Test whether a value is at a bound of the search."""
    if at := _at_box(found):
        text = f"Values at a bound of the search: {', '.join(at)}; the data do not determine them."
        yield Test("all", "bound", float(len(at)), 0.0, 0.0, False, True, text)


def _extrapolated(levels: Levels) -> Iterator[Test]:
    """Test whether the law stays near the measured forces at all measured speeds, both ways."""
    ratio = levels.curve / levels.largest if levels.largest > 0 else 0.0
    text = (
        f"The friction of the law reaches {levels.curve:.3g} {levels.unit} within the measured "
        f"speeds, the data only {levels.largest:.3g} {levels.unit}: a direction or a speed "
        "is missing in the data."
    )
    yield Test("all", "extrapolation", ratio, 0.0, FAR, ratio <= FAR, True, text)


def _unexplained(found: Minimum, effective: Mapping[str, float]) -> Iterator[str]:
    """Yield a message for each signal that is almost entirely unexplained.

    A correct model, too, leaves much of a noisy signal unexplained. But it explains many times the
    share k / n_eff that any k parameters explain of n_eff independent samples of noise.
    """
    for signal, left, there in _left(found):
        some = [c for c in found.channels if c.signal == signal]
        by_chance = (~found.held).sum() / sum(effective[found.label(c)] for c in some)
        if not there > 0 or left <= UNEXPLAINED**2 * there:
            continue
        if 1 - left / there < CHANCE * by_chance:
            yield (
                f"The model leaves {100 * np.sqrt(left / there):.0f} % of {signal} unexplained: "
                "check the model, the columns of the data, their signs and their units."
            )


def _no_mass(found: Minimum) -> Iterator[str]:
    for unknown, held in zip(found.unknowns, found.held, strict=True):
        value = found.values[found.names.index(unknown.name)]
        near = value <= unknown.lower + 1e-3 * max(abs(unknown.start), abs(unknown.lower))
        if held and unknown.unit in INERTIA and near:
            yield (
                f"{unknown.name} is at its lower bound, {value:.3g} {unknown.unit}: the force does "
                "not depend on the acceleration, or one of them has the wrong sign."
            )


def _at_box(found: Minimum) -> list[str]:
    """Return the values at a bound that is neither zero nor another value, and that matter.

    A value matters if the cost would fall significantly beyond the bound: a score test (Lagrange
    multiplier) with the effective number of samples.
    """
    basis = span(found.J * ~found.held)
    worth = sum(c.effective for c in found.colours) / found.r.size
    names = list[str]()
    for u, held, column in zip(found.unknowns, found.held, found.J.T, strict=True):
        if not held or u.partner or u.nuisance or 0.0 in (u.lower, u.upper):
            continue
        clean = column - basis @ (basis.T @ column)
        size = float(np.linalg.norm(clean))
        if size > 1e-9 * float(np.linalg.norm(column)):
            score = float(clean @ found.r) / size / max(rms(found.r), 1e-300)
            names += [u.name] * (score**2 * worth > SCORE)
    return names


def _at_bound(found: Minimum) -> list[str]:
    both = zip(found.unknowns, found.held, strict=True)
    return [u.name for u, held in both if held and not u.nuisance]
