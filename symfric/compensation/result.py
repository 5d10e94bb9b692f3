"""References of a position loop with friction, and results with and without compensation."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any, final

import numpy as np

from symfric.foundation import checks
from symfric.foundation.files import write_table
from symfric.foundation.numeric import Array
from symfric.foundation.shown import brief
from symfric.foundation.style import line

if TYPE_CHECKING:
    from matplotlib.figure import Figure


@final
@dataclass(frozen=True, eq=False)
class Reference:
    """Reference of a position loop.

    Attributes:
        x, v, a: position [m], velocity [m/s], acceleration [m/s^2] at each sample, shape (n,).
        h: sample time [s].
    """

    x: Array
    v: Array
    a: Array
    h: float = 1e-3

    def __post_init__(self) -> None:
        for name in "xva":
            found = checks.array(f"Reference: {name}", getattr(self, name))
            object.__setattr__(self, name, found)
        sizes = [self.x.size, self.v.size, self.a.size]
        if len(set(sizes)) > 1 or sizes[0] < 2:
            raise ValueError(f"Reference: expected x, v, a of one length >= 2, got {sizes}")
        object.__setattr__(self, "h", checks.number("Reference: h", self.h, unit="s", above=0.0))

    __repr__ = brief

    @property
    def t(self) -> Array:
        """Times of the samples [s]."""
        return self.h * np.arange(float(self.x.size))

    @property
    def rest(self) -> slice | None:
        """Second half of the rest at the end; None if this is less than ten samples."""
        last = int(np.flatnonzero(np.diff(self.x) != 0).max(initial=-1)) + 1
        begin = (last + self.x.size) // 2
        return slice(begin, None) if self.x.size - begin >= 10 else None


def sine(amplitude: float, frequency: float, t_end: float, h: float = 1e-3) -> Reference:
    """Return the sine A (1 - cos(2 pi f t)) between 0 and 2 A, which begins at rest.

    Args:
        amplitude: amplitude A [m].
        frequency: frequency f [Hz].
        t_end: end time [s].
        h: sample time [s].
    """
    A = checks.number("sine: amplitude", amplitude, unit="m")
    w = 2 * np.pi * checks.number("sine: frequency", frequency, unit="Hz", above=0.0)
    t = _times("sine", t_end, h)
    return Reference(A * (1 - np.cos(w * t)), A * w * np.sin(w * t), A * w**2 * np.cos(w * t), h)


def step(height: float, t_end: float, t_step: float = 0.1, h: float = 1e-3) -> Reference:
    """Return a jump of the position by `height` [m] at the time `t_step` [s]."""
    height = checks.number("step: height", height, unit="m")
    t = _times("step", t_end, h)
    return Reference(np.where(t >= t_step, height, 0.0), 0 * t, 0 * t, h)


def moves(goals: Sequence[float], duration: float, rest: float, h: float = 1e-3) -> Reference:
    """Return moves from 0 to each goal [m] in turn, each of `duration` [s] and then a `rest` [s].

    Each move is a polynomial of fifth order, with zero velocity and acceleration at both ends.
    """
    places = checks.array("moves: goals", goals)
    duration = checks.number("moves: duration", duration, unit="s", above=0.0)
    rest = checks.number("moves: rest", rest, unit="s", lower=0.0)
    period = duration + rest
    t = _times("moves", period * places.size, h)
    before = np.append(0.0, places[:-1])
    k = np.minimum((t / period).astype(int), places.size - 1)
    s = np.clip((t - k * period) / duration, 0.0, 1.0)
    way = (places - before)[k]
    x = before[k] + way * s**3 * (10 - 15 * s + 6 * s**2)
    v = way / duration * 30 * s**2 * (1 - s) ** 2
    a = way / duration**2 * 60 * s * (1 - s) * (1 - 2 * s)
    return Reference(np.where(s == 1.0, places[k], x), v, a, h)


def _times(where: str, t_end: float, h: float) -> Array:
    h = checks.number(f"{where}: h", h, unit="s", above=0.0)
    t_end = checks.number(f"{where}: t_end", t_end, unit="s", lower=2 * h)
    return np.arange(float(round(t_end / h))) * h


WITHOUT = "without"


@final
@dataclass(frozen=True, eq=False)
class Loop:
    """Result of one loop over n samples.

    Attributes:
        name: name of the case.
        reference: desired motion.
        x, v: true position [m] and velocity [m/s] at the samples and at the end, shape (n + 1,).
        force: force that acted after each sample [N], shape (n,).
        added: force commanded by the compensation at each sample [N], shape (n,).
        limit: largest force [N].
        status: bits that the guards of the blocks have set; 0 if nothing was repaired.
        ended: reason of an early end; "" if there is none.
        estimates: output of the estimator -> its values at the samples, shape (n,).
    """

    name: str
    reference: Reference
    x: Array
    v: Array
    force: Array
    added: Array
    limit: float
    ended: str = ""
    status: int = 0
    estimates: Mapping[str, Array] = field(default_factory=dict[str, Array])

    def __repr__(self) -> str:
        ended = f", {self.ended}" if self.ended else ""
        numbers = f"RMS error {self.rms:.3g}, peak {self.peak:.3g}"
        return f"<Loop '{self.name}': {self.force.size} samples, {numbers}{ended}>"

    @property
    def t(self) -> Array:
        """Times of the samples [s]."""
        return self.reference.t[: self.force.size]

    @property
    def error(self) -> Array:
        """Reference minus true position [m]."""
        return self.reference.x[: self.force.size] - self.x[: self.force.size]

    @property
    def rms(self) -> float:
        """Root mean square of the error [m] without the first tenth of the time."""
        return float(np.sqrt(np.mean(self._late**2)))

    @property
    def peak(self) -> float:
        """Largest error [m] without the first tenth of the time."""
        return _size(self._late)

    @property
    def hunting(self) -> float:
        """Peak-to-peak motion [m] in the second half of the last rest.

        NaN if the reference does not rest at the end, or if the loop ended early.
        """
        rest = self.reference.rest
        return np.nan if rest is None or self.ended else float(np.ptp(self.x[:-1][rest]))

    @property
    def standing(self) -> float:
        """Magnitude of the error at the end [m]."""
        return _size(self.error[-1:])

    @property
    def work(self) -> float:
        """Work of the force [J], exact for a held force."""
        return float(self.force @ np.diff(self.x))

    @property
    def saturated(self) -> float:
        """Fraction of the samples with the force at its limit."""
        return float(np.mean(np.abs(self.force) >= self.limit))

    @property
    def _late(self) -> Array:
        return self.error[self.force.size // 10 :]


@final
@dataclass(frozen=True, eq=False)
class Comparison:
    """Loops with the same plant and reference; the first is without compensation.

    Attributes:
        plant: name of the plant.
        reference: desired motion.
        loops: case -> loop.
        count: one count of the encoder [m].
        engine: description of the engine that runs the blocks.
        units: units of position and force, such as rad and N m, which replace m and N everywhere.
    """

    plant: str
    reference: Reference
    loops: Mapping[str, Loop]
    count: float
    engine: str
    units: tuple[str, str] = ("m", "N")

    def __repr__(self) -> str:
        """Return the table."""
        return self.table()

    def __getitem__(self, name: str) -> Loop:
        checks.check_names("comparison", [name], self.loops)
        return self.loops[name]

    def reduction(self, name: str) -> float:
        """Return the RMS error without compensation divided by that of a case."""
        own = self[name].rms
        return self[WITHOUT].rms / own if own else np.inf

    def remarks(self) -> tuple[str, ...]:
        """Return sentences about undesirable behaviour of the cases."""
        found: list[str] = []
        before = self[WITHOUT]
        for loop in self.loops.values():
            other = loop is not before
            if loop.ended:
                found.append(f"{loop.name}: {loop.ended}")
            hunting, standing = loop.hunting / self.count, loop.standing / self.count
            if hunting >= 1.0:
                found.append(f"{loop.name}: hunts at rest, {hunting:.3g} counts to and fro")
            elif not np.isnan(hunting) and standing >= 1.0:
                found.append(
                    f"{loop.name}: rests {standing:.3g} counts off; unless its integrator is held "
                    "it may break away later"
                )
            if other and loop.rms > before.rms:
                found.append(f"{loop.name}: the error is larger than without compensation")
            if other and loop.hunting > max(before.hunting, self.count):
                found.append(f"{loop.name}: hunts more than without compensation")
            if loop.status:
                found.append(f"{loop.name}: the guards of the C repaired something, {loop.status}")
            if loop.saturated:
                found.append(f"{loop.name}: {loop.saturated:.1%} of the samples at the limit")
        return tuple(found)

    def rows(self) -> list[dict[str, Any]]:
        """Return one row of plain data for each case."""
        return [
            {
                "case": loop.name,
                "rms_error": loop.rms,
                "peak_error": loop.peak,
                "reduction": self.reduction(loop.name),
                "hunting": loop.hunting,
                "work": loop.work,
                "peak_added": _size(loop.added),
                "saturated": loop.saturated,
                "status": loop.status,
                "ended": loop.ended,
            }
            for loop in self.loops.values()
        ]

    def table(self) -> str:
        """Return a table with errors in a suitable unit and hunting in counts."""
        width = max(len(name) for name in self.loops)
        x, force = self.units
        scale, small = _unit_for(max(loop.peak for loop in self.loops.values()))
        small = f"[{small}{x}]"
        head = f"{'case':<{width}} {'RMS ' + small:>10} {'peak ' + small:>11} {'smaller':>8} "
        lines = [
            f"plant '{self.plant}', {self.reference.t[-1]:.3g} s, blocks as {self.engine}",
            head + f"{'hunting [counts]':>17} {'work [J]':>9} {f'added [{force}]':>11}",
        ]
        for row in self.rows():
            hunting = row["hunting"] / self.count
            lines.append(
                f"{row['case']:<{width}} {scale * row['rms_error']:>10.4g} "
                f"{scale * row['peak_error']:>11.4g} {row['reduction']:>8.3g} "
                f"{'-' if np.isnan(hunting) else f'{hunting:.3g}':>17} "
                f"{row['work']:>9.3g} {row['peak_added']:>11.3g}"
            )
        return "\n".join([*lines, *(f"! {remark}" for remark in self.remarks())])

    def to_csv(self, path: str | Path) -> None:
        """Write time, reference, positions, forces and compensation, one row for each sample."""
        x, force = self.units
        columns = {"t [s]": self.reference.t, f"reference [{x}]": self.reference.x}
        for name, loop in self.loops.items():
            columns |= {
                f"x ({name}) [{x}]": loop.x[:-1],
                f"force ({name}) [{force}]": loop.force,
                f"added ({name}) [{force}]": loop.added,
            }
        size = min(column.size for column in columns.values())
        rows = np.column_stack([column[:size] for column in columns.values()]).tolist()
        write_table(path, columns, rows)

    def plot(self, *names: str, path: str | Path | None = None) -> "Figure":
        """Plot position, error, force and compensation over time, and the error at a reversal.

        Args:
            names: cases to show, by default all.
            path: image file.
        """
        from symfric.foundation.panels import legend_below, panels, save  # noqa: PLC0415  (slow to import)

        checks.check_names("comparison", names, self.loops)
        shown = [self.loops[n] for n in names or self.loops]
        x, force = self.units
        figure, axes = panels(5, height=1.6, shared=False)
        near = self._reversal()
        large, of_x = _unit_for(_size(self.reference.x))
        small, of_error = _unit_for(max(_size(loop.error) for loop in shown))
        tiny, of_near = _unit_for(max(_size(loop.error[near]) for loop in shown))
        axes[0].plot(self.reference.t, large * self.reference.x, "k--", lw=0.8, label="reference")
        for number, loop in enumerate(shown):
            t, n, look = loop.t, loop.force.size, line(number)
            axes[0].plot(t, large * loop.x[:n], label=loop.name, **look, lw=1.0)
            axes[1].plot(t, small * loop.error, **look, lw=1.0)
            axes[2].step(t, loop.force, where="post", **look, lw=1.0)
            axes[3].step(t, loop.added, where="post", **look, lw=1.0)
            axes[4].plot(t[near], tiny * loop.error[near], **look, lw=1.0)
        labels = ("x", of_x + x), ("error", of_error + x), ("force", force), ("added", force)
        for axis, (what, unit) in zip(axes, (*labels, ("error", of_near + x)), strict=True):
            axis.set_ylabel(f"{what} [{unit}]")
        for axis in axes[1:4]:
            axis.sharex(axes[0])
        axes[4].set_title("at a reversal" if self.reference.rest is None else "at rest", fontsize=9)
        axes[4].set_xlabel("t [s]")
        legend_below(figure, axes[0], 4, fontsize="small")
        axes[0].set_title(f"plant '{self.plant}'")
        figure.align_ylabels(axes)
        return save(figure, path)

    def _reversal(self) -> slice:
        """Return the samples of the final rest, or around the last reversal without a rest."""
        if self.reference.rest is not None:
            return self.reference.rest
        size = self.reference.x.size
        turns = np.flatnonzero(np.diff(np.sign(self.reference.v[1:])) != 0)
        middle = int(turns[-1]) if turns.size else size // 2
        return slice(max(0, middle - size // 30), middle + size // 15)


def _size(values: Array) -> float:
    return float(np.abs(values).max(initial=0.0))


def _unit_for(size: float) -> tuple[float, str]:
    """Return factor and prefix of the unit in which `size` is at least 1."""
    for factor, prefix in ((1.0, ""), (1e3, "m")):
        if size * factor >= 1.0:
            return factor, prefix
    return 1e6, "u"
