"""Mode sequences: slip directions and stick of contacts over time.

A contact slips forwards (+1), sticks (0) or slips backwards (-1). A `ModeInterval` has one mode of
a contact, and a `Track` consists of its intervals in order. An `Arc` is an interval with constant
modes of all contacts. Ends of phases and via points, whose times are given by the user, divide the
motion into `Leg`s of arcs with free durations.
"""

from collections.abc import Callable, Iterator, Mapping, Sequence
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from ocp.formulation.phase import Array
from ocp.solving.solution import Mode

SAME_INSTANT = 1e-9
"""Time difference, relative to the duration, below which two times coincide."""

SLOWEST = 1e-3
"""Smallest change of a velocity between two times, in multiples of the creep."""

KINDS = {1: "slip+", 0: "stick", -1: "slip-"}
"""Name of each mode."""


class ModeInterval(NamedTuple):
    """Interval from `begin` to `end` [s] with one mode of a contact: +1 and -1 slip, 0 stick."""

    mode: int
    begin: float
    end: float


class Track(NamedTuple):
    """Consecutive runs of one contact, which may exist only in a part of the motion."""

    contact: str
    runs: tuple[ModeInterval, ...]

    def at(self, t: float) -> int | None:
        """Return the mode at a time, or None if the contact does not exist at this time."""
        return next((run.mode for run in self.runs if run.begin <= t <= run.end), None)


class Arc(NamedTuple):
    """Interval from `begin` to `end` [s] with constant modes of all contacts, by name."""

    modes: Mapping[str, int]
    begin: float
    end: float

    @property
    def duration(self) -> float:
        """Duration [s]."""
        return self.end - self.begin


class Leg(NamedTuple):
    """Arcs between two ends or via points of a phase.

    Attributes:
        phase: index of the user's phase.
        part: number of via points of the phase before the leg.
        arcs: consecutive arcs, whose durations add up to the duration of the leg.
    """

    phase: int
    part: int
    arcs: tuple[Arc, ...]

    @property
    def duration(self) -> float:
        """Sum of the durations of the arcs [s]."""
        return self.arcs[-1].end - self.arcs[0].begin

    def replaced(self, begin: int, end: int, *arcs: Arc) -> "Leg":
        """Return the leg with `arcs` in place of its arcs with indices `begin` to `end` - 1."""
        return self._replace(arcs=(*self.arcs[:begin], *arcs, *self.arcs[end:]))


Legs = tuple[Leg, ...]
"""Mode sequence of a motion."""


def read(contact: str, t: Array, slip: Array, creep: float, shortest: float) -> Track:
    """Deduce the track of one contact from its sliding velocities.

    A contact sticks for the time below `creep` minus the time in which it reverses, or starts or
    stops, with the acceleration at both ends of this interval.

    Args:
        contact: name of the contact.
        t, slip: times [s] and sliding velocities [m/s], shape (n,).
        creep: sliding velocity [m/s] below which the contact sticks; smooth laws creep under load.
        shortest: duration [s] below which runs are merged with their neighbours.
    """
    modes = np.where(np.abs(slip) < creep, 0, np.sign(slip)).astype(int)
    first = np.flatnonzero(np.append(True, np.diff(modes) != 0))
    last = np.append(first[1:] - 1, t.size - 1)
    runs = [
        ModeInterval(int(modes[a]), float(t[a]), float(t[b]))
        for a, b in zip(first, last, strict=True)
    ]
    crossing = creep * np.diff(t) / np.maximum(np.abs(np.diff(slip)), SLOWEST * creep)
    crossing = np.concatenate([[0.0], crossing, [0.0]])
    spent = np.where([run.mode == 0 for run in runs], crossing[first] + crossing[last + 1], 0.0)
    long = [run for run, s in zip(runs, spent, strict=True) if run.end - run.begin - s >= shortest]
    kept = list(_merged(long or [max(runs, key=lambda run: run.end - run.begin)]))
    middles = [(a.end + b.begin) / 2 for a, b in pairwise(kept)]
    bounds = pairwise([float(t[0]), *middles, float(t[-1])])
    return Track(
        contact, tuple(ModeInterval(run.mode, *ab) for run, ab in zip(kept, bounds, strict=True))
    )


def with_rests(
    track: Track,
    can_rest: Callable[[float], bool],
    width: float,
    ends: tuple[bool, bool] = (True, True),
) -> Track:
    """Return `track` with stick of about `width` [s] at each reversal, and optionally at its ends.

    Unnecessary stick intervals shrink when durations are optimised, and are then removed. Missing
    stick intervals cannot appear.

    Args:
        track: runs of one contact.
        can_rest: function that returns True if some control can hold the contact at a time. Other
            stick would make the program infeasible.
        width: duration of the stick intervals [s].
        ends: True if the contact sticks at the start, and at the end.
    """
    runs: list[ModeInterval] = []
    for run in track.runs:
        if runs and runs[-1].mode * run.mode < 0 and can_rest(run.begin):
            half = min(width, run.end - run.begin, runs[-1].end - runs[-1].begin) / 2
            runs[-1] = runs[-1]._replace(end=run.begin - half)
            runs.append(ModeInterval(0, run.begin - half, run.begin + half))
            run = run._replace(begin=run.begin + half)
        runs.append(run)
    first = runs[0]
    if ends[0] and first.mode and can_rest(first.begin):
        after = first.begin + min(width, first.end - first.begin) / 2
        runs[0:1] = [ModeInterval(0, first.begin, after), first._replace(begin=after)]
    last = runs[-1]
    if ends[1] and last.mode and can_rest(last.end):
        before = last.end - min(width, last.end - last.begin) / 2
        runs[-1:] = [last._replace(end=before), ModeInterval(0, before, last.end)]
    return track._replace(runs=tuple(runs))


def cut(tracks: Sequence[Track], leg: tuple[int, int], begin: float, end: float) -> Leg:
    """Return the leg (phase, part) from `begin` to `end`, divided at each change of mode."""
    inside = {run.end for track in tracks for run in track.runs if begin < run.end < end}
    near = SAME_INSTANT * (end - begin)
    times = [t for t in sorted(inside) if t - begin > near and end - t > near]
    arcs: list[Arc] = []
    for a, b in pairwise([begin, *times, end]):
        modes = {track.contact: track.at((a + b) / 2) for track in tracks}
        arcs.append(Arc({name: mode for name, mode in modes.items() if mode is not None}, a, b))
    return Leg(*leg, tuple(arcs))


def placed(legs: Legs, durations: Sequence[float]) -> Legs:
    """Return `legs` with other `durations` of their arcs and the same start."""
    times = iter(durations)
    t = legs[0].arcs[0].begin
    moved: list[Leg] = []
    for leg in legs:
        arcs: list[Arc] = []
        for arc in leg.arcs:
            begin, t = t, t + next(times)
            arcs.append(arc._replace(begin=begin, end=t))
        moved.append(leg._replace(arcs=tuple(arcs)))
    return tuple(moved)


def pruned(legs: Legs, shortest: float) -> Legs:
    """Return `legs` without arcs of at most `shortest` [s].

    Neighbours with equal modes are merged. The longest arc of a leg is always kept.
    """
    return tuple(_without(leg, shortest) for leg in legs)


def _without(leg: Leg, shortest: float) -> Leg:
    begin, end = leg.arcs[0].begin, leg.arcs[-1].end
    kept = [arc for arc in leg.arcs if arc.duration > shortest]
    kept = kept or [max(leg.arcs, key=lambda arc: arc.duration)]
    merged = [arc for k, arc in enumerate(kept) if not k or kept[k - 1].modes != arc.modes]
    bounds = pairwise([begin, *(arc.begin for arc in merged[1:]), end])
    arcs = (arc._replace(begin=a, end=b) for arc, (a, b) in zip(merged, bounds, strict=True))
    return leg._replace(arcs=tuple(arcs))


def flat(legs: Legs) -> tuple[Arc, ...]:
    """Return all arcs in order."""
    return tuple(arc for leg in legs for arc in leg.arcs)


def inserted(legs: Legs, number: int, contact: str, mode: int, begin: float, end: float) -> Legs:
    """Return `legs` with `contact` in another mode from `begin` to `end` inside arc `number`."""
    for k, leg in enumerate(legs):
        if number < len(leg.arcs):
            arc = leg.arcs[number]
            a, b = max(begin, arc.begin), min(end, arc.end)
            other = Arc({**arc.modes, contact: mode}, a, b)
            parts = (arc._replace(end=a), other, arc._replace(begin=b))
            kept = (part for part in parts if part.end > part.begin)
            return (*legs[:k], leg.replaced(number, number + 1, *kept), *legs[k + 1 :])
        number -= len(leg.arcs)
    raise IndexError(number)


def tracks_of(legs: Legs) -> dict[str, list[ModeInterval]]:
    """Return contact -> its runs over all legs."""
    runs: dict[str, list[ModeInterval]] = {}
    for arc in flat(legs):
        for contact, mode in arc.modes.items():
            runs.setdefault(contact, []).append(ModeInterval(mode, arc.begin, arc.end))
    return {contact: _merged(own) for contact, own in runs.items()}


def modes_of(runs: Sequence[ModeInterval]) -> tuple[Mode, ...]:
    """Return consecutive runs of one contact as modes of a solution."""
    merged = _merged(runs)
    return tuple(Mode(KINDS[run.mode], *run[1:]) for run in merged if run.end > run.begin)


def shown(legs: Legs) -> str:
    """Return the sequence as text: "0+0- | -0" with "|" between legs, "(+0)" for two contacts."""

    def sign(modes: Mapping[str, int]) -> str:
        signs = "".join("-0+"[mode + 1] for mode in modes.values())
        return signs if len(modes) == 1 else f"({signs})"

    return " | ".join("".join(sign(s.modes) for s in leg.arcs) for leg in legs)


def _merged(runs: Sequence[ModeInterval]) -> list[ModeInterval]:
    """Return `runs` with neighbours of equal mode merged."""
    merged: list[ModeInterval] = []
    for run in runs:
        if merged and merged[-1].mode == run.mode:
            merged[-1] = merged[-1]._replace(end=run.end)
        else:
            merged.append(run)
    return merged


def neighbours(legs: Legs, width: float) -> Iterator[Legs]:
    """Yield sequences with an additional arc of about `width` [s] where changes of mode coincide.

    At the end of a leg, one contact changes its mode before or after the end. Inside a leg, one of
    several simultaneous changes occurs before the others.
    """
    for k, (leg, then) in enumerate(pairwise(legs)):
        last, first = leg.arcs[-1], then.arcs[0]
        for contact in _changes(last, first):
            t = last.end - min(width, last.duration / 2)
            early = Arc({**last.modes, contact: first.modes[contact]}, t, last.end)
            n = len(leg.arcs)
            changed = leg.replaced(n - 1, n, last._replace(end=t), early)
            yield (*legs[:k], changed, *legs[k + 1 :])
            t = first.begin + min(width, first.duration / 2)
            late = Arc({**first.modes, contact: last.modes[contact]}, first.begin, t)
            changed = then.replaced(0, 1, late, first._replace(begin=t))
            yield (*legs[: k + 1], changed, *legs[k + 2 :])
    for k, leg in enumerate(legs):
        for i, (before, after) in enumerate(pairwise(leg.arcs)):
            changes = _changes(before, after)
            for contact in changes if len(changes) > 1 else ():
                half = min(width, before.duration, after.duration) / 2
                a, b = before.end - half, before.end + half
                between = Arc({**before.modes, contact: after.modes[contact]}, a, b)
                parts = before._replace(end=a), between, after._replace(begin=b)
                yield (*legs[:k], leg.replaced(i, i + 2, *parts), *legs[k + 1 :])


def _changes(before: Arc, after: Arc) -> list[str]:
    """Return the contacts whose modes differ between two arcs."""
    return [n for n, mode in before.modes.items() if n in after.modes and after.modes[n] != mode]
