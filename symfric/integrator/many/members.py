"""Run many members to common times, in compiled code or in CasADi's virtual machine.

Both advance the members' columns S in place and return their signals; no steps are kept.
"""

import ctypes
from dataclasses import dataclass
from string import Template
from typing import Protocol, final

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from symfric.integrator.compiled.columns import Columns, densified
from symfric.integrator.compiled.compiler import load
from symfric.integrator.running.dense import from_records
from symfric.integrator.running.engine import Stop, VmEngine
from symfric.integrator.running.loop import c_source, width
from symfric.integrator.step.layout import Given, State

Array = NDArray[np.float64]
Counts = NDArray[np.int64]
ROWS, ATTEMPTS = 2048, 2000


@final
@dataclass(frozen=True, eq=False)
class Stretch:
    """What members go through together.

    Attributes:
        breaks: ends of input intervals [s], shape (k + 1,).
        data: input data on them, shape (n_data, k).
        times: times of the results [s], from breaks[0] to breaks[-1].
        max_steps: attempts allowed, counting those made before.
        h_min: smallest step [s].
    """

    breaks: Array
    data: Array
    times: Array
    max_steps: int
    h_min: float


Advanced = tuple[Array, Counts, Array]


class Members(Protocol):
    """Runs members one after another."""

    def run(self, S: Array, R: Array, made: Counts, stretch: Stretch) -> Advanced:
        """Advance members over a stretch.

        Args:
            S: start columns S, one a row, advanced in place.
            R: run data R, one a row.
            made: attempts of each member, added to in place.
            stretch: intervals and times.

        Returns:
            Signals (members, times, signals), NaN from where a member stopped; why (members,);
            largest magnitudes of the unknowns at the ends of steps (members, n).
        """
        ...


@final
@dataclass(frozen=True, eq=False)
class VmMembers:
    """Members in CasADi's virtual machine; needs no compiler."""

    engine: VmEngine
    signals: Columns

    @classmethod
    def of(cls, step: str, signals: str) -> "VmMembers":
        """From the serialised Functions of the step and of the signals."""
        return cls(
            VmEngine.of(ca.Function.deserialize(step)), Columns(ca.Function.deserialize(signals))
        )

    def run(self, S: Array, R: Array, made: Counts, stretch: Stretch) -> Advanced:
        """Advance members over a stretch."""
        found = np.full(
            (S.shape[0], stretch.times.size, self.signals.function.numel_out(0)), np.nan
        )
        reason, largest = np.zeros(S.shape[0], dtype=np.int64), np.abs(S[:, State.Y])
        for m in range(S.shape[0]):
            reason[m], made[m] = self._one(
                S[m], R[m].copy(), int(made[m]), stretch, found[m], largest[m]
            )
        return found, reason, largest

    def _one(
        self, S: Array, R: Array, made: int, stretch: Stretch, found: Array, largest: Array
    ) -> tuple[Stop, int]:
        n_data, n_d = stretch.data.shape[0], self.signals.function.numel_in(2)
        last, stop = stretch.breaks.size - 2, Stop.END
        for k in range(last + 1):
            R[Given.T_END], R[R.size - n_data :] = stretch.breaks[k + 1], stretch.data[:, k]
            from_t, y0 = S[State.T], S[State.Y].copy()
            records, made, stop = self._attempts(S, R, made, stretch)
            ends = from_records(records, y0.size).y1
            largest[:] = np.maximum(largest, np.abs(ends).max(axis=0, initial=0.0))
            at = stretch.times[(stretch.times >= stretch.breaks[k]) & (stretch.times <= S[State.T])]
            if k < last:
                at = at[at < stretch.breaks[k + 1]]
            y, inside = np.tile(y0, (at.size, 1)), at > from_t
            if inside.any():
                y[inside] = from_records(records, y0.size)(at[inside]).T
            d = np.tile(R[R.size - n_d :], (at.size, 1))
            found[np.searchsorted(stretch.times, at)] = self.signals([at, y, d])[0]
            if stop is not Stop.END:
                break
        return stop, made

    def _attempts(self, S: Array, R: Array, made: int, stretch: Stretch) -> tuple[Array, int, Stop]:
        """Advance over one interval; all records, attempts made, why it stopped."""
        found: list[Array] = []
        stop = Stop.FULL
        while stop is Stop.FULL or (stop is Stop.ATTEMPTS and made < stretch.max_steps):
            allowed = min(ATTEMPTS, stretch.max_steps - made)
            records, count, stop = self.engine.run(S, R, ROWS, allowed, stretch.h_min)
            made += count
            found.append(records)
        return np.vstack(found), made, stop


@final
@dataclass(frozen=True, eq=False)
class CompiledMembers:
    """Members in a compiled loop; releases the GIL."""

    library: ctypes.CDLL
    signals: int

    @classmethod
    def of(cls, source: str, signals: int) -> "CompiledMembers":
        """From the C of `many_source`; compiles, or loads from the cache."""
        library = load(source, "symfric_many")
        library.symfric_many.restype = None
        library.symfric_many.argtypes = [
            *[ctypes.c_void_p] * 2,
            *[ctypes.c_longlong] * 2,
            *[ctypes.c_void_p] * 2,
            *[ctypes.c_longlong] * 2,
            ctypes.c_void_p,
            *[ctypes.c_longlong] * 2,
            ctypes.c_double,
            *[ctypes.c_void_p] * 4,
        ]
        return cls(library, signals)

    def run(self, S: Array, R: Array, made: Counts, stretch: Stretch) -> Advanced:
        """Advance members over a stretch."""
        members, data = S.shape[0], np.ascontiguousarray(stretch.data)
        found = np.empty((members, stretch.times.size, self.signals))
        reason, filled = np.zeros(members, dtype=np.int64), R.copy()
        largest = np.abs(S[:, State.Y])
        self.library.symfric_many(
            S.ctypes.data,
            filled.ctypes.data,
            filled.shape[1],
            members,
            stretch.breaks.ctypes.data,
            data.ctypes.data,
            data.shape[1],
            data.shape[0],
            stretch.times.ctypes.data,
            stretch.times.size,
            stretch.max_steps,
            stretch.h_min,
            found.ctypes.data,
            reason.ctypes.data,
            made.ctypes.data,
            largest.ctypes.data,
        )
        return found, reason, largest


def many_source(step: ca.Function, signals: ca.Function) -> str:
    """C of the step and of the signals, with the loop over members."""
    n = step.numel_in(0) - State.MEMORY
    dense_rows = step.numel_out(1) // n
    values = densified(signals)
    return c_source(step, dense_rows, values) + Template(_MANY).substitute(
        n=n,
        memory=State.MEMORY,
        t=State.T,
        t_end=Given.T_END,
        width=width(n, dense_rows),
        dense_rows=dense_rows,
        signals=values.name(),
        n_signals=values.numel_out(0),
        n_d=values.numel_in(2),
        arg=values.sz_arg(),
        res=values.sz_res(),
        iw=max(1, values.sz_iw()),
        w=max(1, values.sz_w()),
    )


_MANY = """
/* All signals at time t. */
static void symfric_values(double t, const double *y, const double *d, double *values)
{
  double w[$w];
  casadi_int iw[$iw];
  const double *arg[$arg];
  double *res[$res];
  arg[0] = &t;
  arg[1] = y;
  arg[2] = d;
  res[0] = values;
  $signals(arg, res, iw, w, 0);
}

/* Signals of `members` runs at common times, over common input intervals; no record is kept.
   S: member-wise start, R: member-wise run data, whose last n_data entries the intervals fill.
   A time at which an interval begins belongs to that interval. */
void symfric_many(double *S, double *R, long long size_R, long long members, const double *breaks,
                  const double *data, long long intervals, long long n_data, const double *times,
                  long long n_times, long long max_attempts, double h_min, double *out,
                  long long *reason, long long *made, double *largest)
{
  enum { N = $n, MEM = $memory, ROWS = $dense_rows, WIDTH = $width, SIGNALS = $n_signals,
         T = $t, T_END = $t_end };
  double row[WIDTH], y[N];
  long long m, k, i, r, count[2];
  for (m = 0; m < members; ++m, S += MEM + N, R += size_R, largest += N) {
    const double *d = R + size_R - $n_d;
    long long next = 0;
    int stop = 0;
    for (k = 0; k < intervals && stop == 0; ++k) {
      const int last = k + 1 == intervals;
      R[T_END] = breaks[k + 1];
      for (i = 0; i < n_data; ++i) R[size_R - n_data + i] = data[i * intervals + k];
      for (; next < n_times && times[next] <= S[T]; ++next, out += SIGNALS)
        symfric_values(times[next], S + MEM, d, out);
      stop = 1;
      while (stop == 1) {
        stop = symfric_run(S, R, row, 1, max_attempts - made[m], h_min, count);
        made[m] += count[1];
        if (!count[0]) break;
        for (i = 0; i < N; ++i) largest[i] = fmax(largest[i], fabs(row[2 + N + i]));
        for (; next < n_times && times[next] <= row[1] && (last || times[next] < R[T_END]);
             ++next, out += SIGNALS) {
          const double s = (times[next] - row[0]) / (row[1] - row[0]);
          for (i = 0; i < N; ++i) {
            double bend = 0.;
            for (r = ROWS - 1; r >= 0; --r) bend = row[2 + 2 * N + r * N + i] + s * bend;
            y[i] = (1. - s) * row[2 + i] + s * (row[2 + N + i] + (1. - s) * bend);
          }
          symfric_values(times[next], y, d, out);
        }
      }
    }
    reason[m] = stop;
    for (; next < n_times; ++next)
      for (i = 0; i < SIGNALS; ++i) *out++ = 0. / 0.;
  }
}
"""
