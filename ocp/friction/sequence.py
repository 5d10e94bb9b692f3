"""Mode sequences: slip directions and stick of contacts over time.

A contact slips forwards (+1), sticks (0) or slips backwards (-1). A `Run` is the time it spends in
one of these modes, a `Track` its runs in order. For several contacts, a motion is a sequence of
`Arc`s between the instants at which any of them changes; instants set by the user, ends of phases
and via points, bound the `Leg`s, inside which durations are free.
"""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import final

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
SAME_INSTANT = 1e-9
"""Share of the whole duration below which two instants coincide."""


@final
@dataclass(frozen=True)
class Run:
    """A contact in one mode from `begin` to `end` [s]: +1 and -1 slip, 0 stick."""

    mode: int
    begin: float
    end: float


@final
@dataclass(frozen=True)
class Track:
    """Runs of one contact, without gaps; the contact may exist for a part of the motion."""

    contact: str
    runs: tuple[Run, ...]

    def at(self, t: float) -> int | None:
        """Return the mode at a time; None if the contact does not exist then."""
        return next((run.mode for run in self.runs if run.begin <= t <= run.end), None)


@final
@dataclass(frozen=True)
class Arc:
    """Interval [s] with constant modes of all contacts; modes by the name of the contact."""

    modes: Mapping[str, int]
    begin: float
    end: float

    @property
    def duration(self) -> float:
        """Duration [s]."""
        return self.end - self.begin


@final
@dataclass(frozen=True)
class Leg:
    """Arcs between two instants set by the user.

    Attributes:
        phase: index of the user's phase.
        part: number of its via points before.
        arcs: in order; their durations add up to the duration of the leg.
    """

    phase: int
    part: int
    arcs: tuple[Arc, ...]

    @property
    def duration(self) -> float:
        """Sum of the durations [s]."""
        return self.arcs[-1].end - self.arcs[0].begin


def read(contact: str, t: Array, slip: Array, creep: float, shortest: float) -> Track:
    """Deduce the track of one contact from its sliding velocities.

    Args:
        t, slip: times [s], and sliding velocities there, shape (n,).
        creep: slower than this it sticks: a smooth law creeps under load.
        shortest: runs shorter than this [s] are merged with their neighbours.
    """
    modes = np.where(np.abs(slip) < creep, 0, np.sign(slip)).astype(int)
    first = np.flatnonzero(np.append(True, np.diff(modes) != 0))
    last = np.append(first[1:] - 1, t.size - 1)
    runs = [Run(int(modes[a]), float(t[a]), float(t[b])) for a, b in zip(first, last, strict=True)]
    long = [run for run in runs if run.end - run.begin >= shortest]
    kept = list(_merged(long or [max(runs, key=lambda run: run.end - run.begin)]))
    middles = [(a.end + b.begin) / 2 for a, b in pairwise(kept)]
    bounds = [float(t[0]), *middles, float(t[-1])]
    return Track(
        contact,
        tuple(Run(run.mode, a, b) for run, (a, b) in zip(kept, pairwise(bounds), strict=True)),
    )


def with_rests(
    track: Track,
    can_rest: Callable[[float], bool],
    width: float,
    ends: tuple[bool, bool] = (True, True),
) -> Track:
    """Return `track` with stick of about `width` [s] at every reversal, and optionally at its ends.

    Unnecessary stick intervals shrink when the durations are optimised, and are removed; missing
    ones cannot appear.

    Args:
        can_rest: whether some control can hold the contact at a time: stick that nothing can hold
            would make the program infeasible.
        ends: whether the contact sticks at the start and at the end.
    """
    runs: list[Run] = []
    for run in track.runs:
        if runs and runs[-1].mode * run.mode < 0 and can_rest(run.begin):
            half = min(width, run.end - run.begin, runs[-1].end - runs[-1].begin) / 2
            runs[-1] = replace(runs[-1], end=run.begin - half)
            runs.append(Run(0, run.begin - half, run.begin + half))
            run = replace(run, begin=run.begin + half)
        runs.append(run)
    first, last = runs[0], runs[-1]
    if ends[0] and first.mode and can_rest(first.begin):
        after = first.begin + min(width, first.end - first.begin) / 2
        runs[0:1] = [Run(0, first.begin, after), replace(first, begin=after)]
    last = runs[-1]
    if ends[1] and last.mode and can_rest(last.end):
        before = last.end - min(width, last.end - last.begin) / 2
        runs[-1:] = [replace(last, end=before), Run(0, before, last.end)]
    return replace(track, runs=tuple(runs))


def cut(tracks: Sequence[Track], leg: tuple[int, int], begin: float, end: float) -> Leg:
    """Return the leg (phase, part) from `begin` to `end`, cut at every change of mode."""
    inside = {run.end for track in tracks for run in track.runs if begin < run.end < end}
    near = SAME_INSTANT * (end - begin)
    times = [begin]
    times += [t for t in sorted(inside) if t - begin > near and end - t > near]
    arcs: list[Arc] = []
    for a, b in pairwise([*times, end]):
        found = {track.contact: track.at((a + b) / 2) for track in tracks}
        modes = {name: mode for name, mode in found.items() if mode is not None}
        arcs.append(Arc(modes, a, b))
    return Leg(*leg, tuple(arcs))


def placed(legs: Sequence[Leg], durations: Sequence[float]) -> tuple[Leg, ...]:
    """Return `legs` with other durations of their arcs, in sequence from the same start."""
    times = iter(durations)
    t = legs[0].arcs[0].begin
    found: list[Leg] = []
    for leg in legs:
        arcs: list[Arc] = []
        for arc in leg.arcs:
            begin, t = t, t + next(times)
            arcs.append(replace(arc, begin=begin, end=t))
        found.append(replace(leg, arcs=tuple(arcs)))
    return tuple(found)


def pruned(legs: Sequence[Leg], shortest: float) -> tuple[Leg, ...]:
    """Return `legs` without arcs up to `shortest` [s] long.

    Equal neighbours are merged; the last arc of a leg always stays.
    """
    return tuple(_without(leg, shortest) for leg in legs)


def count(legs: Sequence[Leg]) -> int:
    """Return the number of arcs."""
    return sum(len(leg.arcs) for leg in legs)


def flat(legs: Sequence[Leg]) -> tuple[Arc, ...]:
    """Return all arcs in order."""
    return tuple(arc for leg in legs for arc in leg.arcs)


def inserted(
    legs: Sequence[Leg], number: int, contact: str, mode: int, begin: float, end: float
) -> tuple[Leg, ...]:
    """Return `legs` with `contact` in another mode from `begin` to `end` inside arc `number`."""
    found: list[Leg] = []
    seen = 0
    for leg in legs:
        arcs: list[Arc] = []
        for arc in leg.arcs:
            if seen == number:
                a, b = max(begin, arc.begin), min(end, arc.end)
                other = Arc({**arc.modes, contact: mode}, a, b)
                parts = (replace(arc, end=a), other, replace(arc, begin=b))
                arcs += [part for part in parts if part.end > part.begin]
            else:
                arcs.append(arc)
            seen += 1
        found.append(replace(leg, arcs=tuple(arcs)))
    return tuple(found)


def tracks_of(legs: Sequence[Leg]) -> dict[str, tuple[Run, ...]]:
    """Return contact -> its runs, over all legs."""
    found: dict[str, list[Run]] = {}
    for arc in flat(legs):
        for contact, mode in arc.modes.items():
            found.setdefault(contact, []).append(Run(mode, arc.begin, arc.end))
    return {contact: tuple(_merged(runs)) for contact, runs in found.items()}


def shown(legs: Sequence[Leg]) -> str:
    """Return the sequence as text, such as "0+0- | -0": legs separated, contacts in brackets."""

    def sign(modes: Mapping[str, int]) -> str:
        signs = "".join("-0+"[mode + 1] for mode in modes.values())
        return signs if len(modes) == 1 else f"({signs})"

    return " | ".join("".join(sign(s.modes) for s in leg.arcs) for leg in legs)


def _merged(runs: Sequence[Run]) -> Iterator[Run]:
    """Yield runs with equal neighbours merged."""
    held: Run | None = None
    for run in runs:
        if held is not None and held.mode == run.mode:
            held = replace(held, end=run.end)
            continue
        if held is not None:
            yield held
        held = run
    if held is not None:
        yield held


def _without(leg: Leg, shortest: float) -> Leg:
    begin, end = leg.arcs[0].begin, leg.arcs[-1].end
    kept = [s for s in leg.arcs if s.duration > shortest]
    kept = kept or [max(leg.arcs, key=lambda s: s.duration)]
    merged: list[Arc] = []
    for arc in kept:
        if merged and merged[-1].modes == arc.modes:
            merged[-1] = replace(merged[-1], end=arc.end)
        else:
            merged.append(arc)
    starts = [begin, *(s.begin for s in merged[1:]), end]
    fitted = [
        replace(s, begin=a, end=b) for s, (a, b) in zip(merged, pairwise(starts), strict=True)
    ]
    return replace(leg, arcs=tuple(fitted))


def neighbours(legs: Sequence[Leg], width: float) -> Iterator[tuple[Leg, ...]]:
    """Yield sequences with an additional arc of about `width` [s] where changes of mode coincide.

    At the end of a leg the modes of the next one start earlier, or its own last modes end later,
    for each contact; inside a leg simultaneous changes of contacts become consecutive.
    """
    for k, (leg, then) in enumerate(pairwise(legs)):
        last, first = leg.arcs[-1], then.arcs[0]
        for contact in _changes(last, first):
            early = {**last.modes, contact: first.modes[contact]}
            yield _with_leg(legs, k, _appended(leg, early, width))
            late = {**first.modes, contact: last.modes[contact]}
            yield _with_leg(legs, k + 1, _prepended(then, late, width))
    for k, leg in enumerate(legs):
        for i, (before, after) in enumerate(pairwise(leg.arcs)):
            changes = _changes(before, after)
            for contact in changes if len(changes) > 1 else ():
                modes = {**before.modes, contact: after.modes[contact]}
                half = min(width, before.duration, after.duration) / 2
                t = before.end
                parts = (
                    replace(before, end=t - half),
                    Arc(modes, t - half, t + half),
                    replace(after, begin=t + half),
                )
                yield _with_leg(
                    legs, k, replace(leg, arcs=(*leg.arcs[:i], *parts, *leg.arcs[i + 2 :]))
                )


def _changes(before: Arc, after: Arc) -> list[str]:
    """Return contacts of both arcs whose modes differ."""
    both = [name for name in before.modes if name in after.modes]
    return [name for name in both if before.modes[name] != after.modes[name]]


def _with_leg(legs: Sequence[Leg], number: int, leg: Leg) -> tuple[Leg, ...]:
    return (*legs[:number], leg, *legs[number + 1 :])


def _appended(leg: Leg, modes: dict[str, int], width: float) -> Leg:
    last = leg.arcs[-1]
    t = last.end - min(width, last.duration / 2)
    return replace(leg, arcs=(*leg.arcs[:-1], replace(last, end=t), Arc(modes, t, last.end)))


def _prepended(leg: Leg, modes: dict[str, int], width: float) -> Leg:
    first = leg.arcs[0]
    t = first.begin + min(width, first.duration / 2)
    return replace(leg, arcs=(Arc(modes, first.begin, t), replace(first, begin=t), *leg.arcs[1:]))
