"""Set up the simulations of `Shooting` from a model and data: names, windows, start values."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from functools import cached_property
from typing import Any, final

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from identification.data.dataset import Dataset
from identification.data.record import Record
from identification.residuals.evaluation import DEAD_TIME, Channel
from identification.residuals.initial import Begin, Sensed, cut, hidden, noise_of, turnaround
from identification.residuals.shots import Drives, Shot, Shots, delayed, plain
from identification.residuals.stepper import why_not_sampled
from identification.unknowns.spec import Unknown
from symfric.foundation import checks
from symfric.foundation.numeric import is_number
from symfric.foundation.programs import find_compiler
from symfric.integrator import Hold, Linear
from symfric.model import Model

SUBSTEPS = (1, 2, 4, 8, 16, 32)
"""Candidate numbers of steps per sample of the sampled engine."""
SHARE = 1e-5
"""Tolerable error relative to the spread of a signal, if the engine is requested explicitly."""
RTOLS, FINEST = (1e-6, 1e-7, 1e-8), 1e-9
"""Candidate tolerances of simulations, and the reference tolerance."""
BIAS = 0.1
"""Largest shift of an estimate by simulation errors, in standard errors."""
LEAST_WINDOWS, FEWEST_SAMPLES = 5, 20
"""Least number of windows of a record for distant starts, and least samples of such a window."""
MOST_STARTS = 60
"""Largest number of start values in such windows; a part of the data is sufficient for them."""
NOISELESS = 1e-9
"""Noise relative to the size of a signal below which the signal counts as noise-free."""


@final
class Preparation:
    """Setup of the residuals of a model on data.

    Args:
        kind: settings, a `Shooting`; only `Shooting.prepare` creates this class.
        model: model of the motion.
        data: records to compare.
        start: parameter -> value at which simulations choose tolerances.
        every: use every n-th window of a record.
    """

    def __init__(
        self, kind: Any, model: Model, data: Dataset, start: Mapping[str, float], every: int = 1
    ) -> None:
        self.kind, self.model, self.every = kind, model, every
        self.values = {v.name: float(start.get(v.name, v.start)) for v in model.p}
        self.records = list(data)
        self.states = [v.name for v in model.x]
        self.hidden = sorted(hidden(model))
        self.signals = self._signals()
        self.inputs = self._inputs()
        self.channels = {n: c for n, c in self.inputs.items() if isinstance(c, str)}
        self.others = {n: c for n, c in self.inputs.items() if not isinstance(c, str)}
        self.own = list[Unknown]()
        given = {} if isinstance(kind.x0, str) else kind.x0
        for name, value in checks.named("Shooting: x0", given, self.states).items():
            where = f"Shooting: x0: {name}"
            if isinstance(value, str):
                checks.choice(where, value, ("estimate",))
            elif not np.ndim(value):
                checks.number(where, value)
            elif (size := checks.array(where, value).size) != (n := len(self.records)):
                such = f"a number for each of the {n} records"
                raise ValueError(f"{where}: expected {such}, got {size}")

    def shots(self) -> Shots:
        """Return the residuals of all records, cut into windows."""
        tau, model = self.kind.dead_time, plain(self.model, self.signals)
        parameters = tuple(v.name for v in model.p)
        if isinstance(tau, tuple):
            if not self.channels:
                such = "an input that is a channel"
                raise ValueError(f"Shooting: dead_time: expected {such}, got none")
            low, high = tau
            tau = Unknown(DEAD_TIME, "s", (low + high) / 2, low, high, high - low, nuisance=True)
            self.own.append(tau)
            tau, model = None, delayed(model, [*self.channels])
        pieces, channels, rows = list[Shot](), list[Channel](), 0
        for number, record in enumerate(self.records):
            found = list(self._cut(number, record, rows))
            pieces += found
            channels += self._channels(number, record, found, rows)
            rows = channels[-1].rows.stop
        shots = Shots(
            parameters, tuple(self.own), tuple(channels), model, tuple(pieces), tau,
            self.kind.rtol or RTOLS[-1], "compiled" if find_compiler() else "vm",
        )  # fmt: skip
        values = np.array([*self.values.values(), *(u.start for u in self.own)])
        shots = replace(shots, substeps=self._substeps(shots, values))
        if self.kind.rtol is None and not shots.substeps:
            shots = replace(shots, rtol=_rtol(shots, values))
        return shots

    def easier(self) -> tuple[float, int] | None:
        """Return a window length [s] with motions near the data, and a stride between windows.

        Return None if the windows are already as short as that.
        """
        spans = [float(r.time[-1] - r.time[0]) for r in self.records]
        found = [
            min(turnaround(r.time, r[c]), span / LEAST_WINDOWS)
            for r, span in zip(self.records, spans, strict=True)
            for c in self.signals.values()
            if c in r
        ]
        least = FEWEST_SAMPLES * max(r.median_step for r in self.records)
        length = max(float(np.median(found)), least)
        if (self.kind.seconds or max(spans)) < 2 * length:
            return None
        count = sum(max(1, round(span / length)) for span in spans)
        return length, max(1, count * len(self.states) // MOST_STARTS)

    # ---- compared signals and inputs

    def _signals(self) -> dict[str, str]:
        """Return signal of the model -> channel, for all signals present in some record."""
        where, given = "Shooting: signals", self.kind.signals
        here = sorted({name for record in self.records for name in record.signals})
        driven = {v.name for v in self.model.u}
        known = [n for n in self.model.signals if n not in driven]
        if given is None:
            found = {n: n for n in known if any(n in record for record in self.records)}
        elif isinstance(given, Mapping):
            found = {n: str(c) for n, c in checks.named(where, given, known).items()}
        else:
            found = {n: n for n in checks.names(where, given, known)}
        missing = [c for c in found.values() if not any(c in r for r in self.records)]
        if missing or not found:
            lacking = ", ".join(missing or known)
            raise ValueError(
                f"{where}: expected channels for {lacking}, got {', '.join(here)}; name them as "
                "signals={'signal of the model': 'channel'}"
            )
        for n, channel in found.items():
            self._same_unit(where, n, self.model.signals[n], channel)
        return found

    def _same_unit(self, where: str, name: str, unit: str, channel: str) -> None:
        for record in self.records:
            there = record.unit(channel) if channel in record else ""
            if unit and there and unit != there:
                got = f"{channel} of '{record.name}' in {there}; pass units= when reading the data"
                raise ValueError(f"{where}: expected {name} in {unit}, got {got}")

    def _inputs(self) -> dict[str, Any]:
        """Return input of the model -> channel, or an input of `simulate`."""
        where = "Shooting: inputs"
        units = {v.name: v.unit for v in self.model.u}
        given = checks.named(where, self.kind.inputs, units)
        found = {name: given.get(name, name) for name in units}
        for name, source in found.items():
            if isinstance(source, Hold | Linear):
                self._check_span(f"{where}: {name}", source)
            if not isinstance(source, str):
                continue
            for record in self.records:
                if source not in record:
                    raise ValueError(
                        f"{where}: expected a channel '{source}' for the input {name}, got none in "
                        f"'{record.name}'; name it as inputs={{'{name}': 'channel'}}, or give a "
                        "number"
                    )
            self._same_unit(where, name, units[name], source)
        return found

    @cached_property
    def timeless(self) -> bool:
        """True if the motion does not depend on the origin of time.

        Windows then start near t = 0, because steps are not resolved at times such as 1e9 s.
        """
        model, outputs = self.model, self.model.outputs
        given = [outputs[n].expression for n in self.signals if n in outputs]
        parts = [e for e in (model.ode, model.alg, model.residual, *given) if e is not None]
        timed = ca.depends_on(ca.veccat(*map(ca.SX, parts)), model.t)
        return not timed and not model.events and all(map(is_number, self.others.values()))

    def _check_span(self, where: str, source: Hold | Linear) -> None:
        """Raise ValueError if the samples of an input do not cover a record."""
        t = np.ravel(np.asarray(source.t, dtype=float))
        slack = float(np.median(np.diff(t))) if t.size > 1 else np.inf  # one number is constant
        for record in self.records:
            first, last = record.time[0], record.time[-1]
            if first < t[0] - slack or last > t[-1] + slack:
                raise ValueError(
                    f"{where}: expected samples over {first:g} ... {last:g} s, the time of "
                    f"'{record.name}', got {t[0]:g} ... {t[-1]:g} s"
                )

    # ---- windows of records

    def _cut(self, number: int, record: Record, row: int) -> Iterator[Shot]:
        """Yield the windows of one record, whose residuals begin at `row`, sorted by signal."""
        origin = float(record.time[0]) if self.timeless else 0.0
        t = record.time - origin
        measured = {s: record[c] for s, c in self.signals.items() if c in record}
        if not measured:
            raise ValueError(
                f"Shooting: expected one of {', '.join(self.signals.values())} in "
                f"'{record.name}', got {', '.join(record.signals)}"
            )
        sensed = Sensed.of(self.model, t, {s: y for s, y in measured.items() if s in self.states})
        windows = cut(t, self.kind.seconds, sensed.speed if sensed.slips else None)[:: self.every]
        looks = [np.arange(w.start, w.stop, self.kind.every) for w in windows]
        total = sum(look.size for look in looks)
        sampled = {n: record[c] for n, c in self.channels.items()}
        drives = Drives(t, sampled, self.others, self.kind.interpolation == "hold")
        for w, look in enumerate(looks):
            firsts = range(row, row + len(measured) * total, total)
            places = {s: slice(k, k + look.size) for s, k in zip(measured, firsts, strict=True)}
            label = f"[{number}]" if len(windows) == 1 else f"[{number},{w}]"
            held, free = self._start(number, sensed, int(look[0]), label)
            here = {s: y[look] for s, y in measured.items()}
            end = float(t[windows[w].stop - 1])
            yield Shot(record.name, origin, t[look], end, here, places, drives, held, free)
            row += look.size

    def _start(
        self, number: int, sensed: Sensed, k: int, label: str
    ) -> tuple[dict[str, float], dict[str, int]]:
        """Return the held start values, and the columns of the estimated start values."""
        given = self.kind.x0
        if given == "given" and k == 0:
            return {}, {}
        begin = sensed.at(k)
        if k > 0:  # the start values of the model do not apply to later times
            begin |= {n: Begin(None) for n in self.hidden if n not in begin}
        held, free = dict[str, float](), dict[str, int]()
        for v in self.model.x:
            wish = None if isinstance(given, str) or k > 0 else given.get(v.name)
            here = begin.get(v.name, None if wish is None else Begin(None))
            if wish is not None and not isinstance(wish, str):
                held[v.name] = float(np.ravel(wish)[number if np.ndim(wish) else 0])
            elif here is None:
                continue
            elif (
                (value := here.value) is not None
                and wish is None
                and (not here.estimated or given == "data")
            ):
                held[v.name] = value
            else:
                if value is None:  # without data, the state has the start of the model
                    known = {n: b.value for n, b in begin.items() if b.value is not None}
                    starts = self.model.initial_state(known, self.values)
                    value = float(starts[self.states.index(v.name)])
                name, scale = f"x0.{v.name}{label}", here.scale if here.scale > 0 else v.nominal
                free[v.name] = len(self.model.p) + len(self.own)
                self.own.append(Unknown(name, v.unit, value, scale=scale, nuisance=True))
        return held, free

    def _channels(
        self, number: int, record: Record, pieces: Sequence[Shot], row: int
    ) -> Iterator[Channel]:
        t = np.concatenate([piece.origin + piece.t for piece in pieces])
        breaks = tuple(np.cumsum([piece.t.size for piece in pieces])[:-1].tolist())
        inputs = {n: np.interp(t, record.time, record[c]) for n, c in self.channels.items()}
        for s in pieces[0].measured:
            y, unit = np.concatenate([piece.measured[s] for piece in pieces]), self.model.signals[s]
            rows = slice(row, row := row + t.size)
            yield Channel(number, s, unit, rows, t, y, inputs, breaks)

    # ---- accuracy

    def _substeps(self, shots: Shots, values: NDArray[np.float64]) -> int:
        """Return the steps per sample of the sampled engine; 0 if `simulate` is used.

        This is the smallest number of steps with a tolerable error.
        """
        engine = self.kind.engine
        others = ", ".join(name for name in self.signals if name not in self.states)
        odd = ", ".join(n for n, given in self.others.items() if not is_number(given))
        why = "" if engine == "simulate" else why_not_sampled(self.model)
        if others and not why:
            why = f"expected signals among the states {', '.join(self.states)}, got {others}"
        elif odd and not why:
            why = f"expected inputs that are channels or numbers, got another type for {odd}"
        if engine == "sampled" and why:
            raise ValueError(f"Shooting: engine: model '{self.model.name}': {why}")
        wanted = self.kind.rtol is None and bool(self.model.contacts)
        if engine == "simulate" or why or (engine == "auto" and not wanted):
            return 0
        most = list[float]()
        for c in shots.channels:
            noise, share = noise_of(c.measured), SHARE * float(np.std(c.measured))
            exact = BIAS * noise / np.sqrt(shots.rows)  # the same requirement as in `_rtol`
            most.append(exact if engine == "auto" else max(noise, share))
        coarse = replace(shots, substeps=SUBSTEPS[0]).predicted(values)
        for substeps in SUBSTEPS:
            fine = replace(shots, substeps=2 * substeps).predicted(values)
            if isinstance(coarse, str) or isinstance(fine, str):
                break
            errors = [np.sqrt(np.mean((fine - coarse)[c.rows] ** 2)) for c in shots.channels]
            if all(error <= limit for error, limit in zip(errors, most, strict=True)):
                return substeps
            coarse = fine
        return 0 if engine == "auto" else SUBSTEPS[-1]


def _rtol(shots: Shots, values: NDArray[np.float64]) -> float:
    """Return the largest tolerance that biases no estimate by a tenth of its standard error.

    A simulation error e shifts estimates by at most |e / noise| standard errors, regardless of the
    number of samples. The error is evaluated at the start values.
    """
    fine = replace(shots, rtol=FINEST).predicted(values)
    if isinstance(fine, str):
        return RTOLS[-1]
    noise = np.empty(fine.size)
    for channel in shots.channels:
        size = float(np.abs(channel.measured).max()) or np.inf
        noise[channel.rows] = max(noise_of(channel.measured), NOISELESS * size)
    for rtol in RTOLS[:-1]:
        found = replace(shots, rtol=rtol).predicted(values)
        if isinstance(found, str):
            break
        if np.linalg.norm((found - fine) / noise) <= BIAS:
            return rtol
    return RTOLS[-1]
