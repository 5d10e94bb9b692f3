"""Run many attempts of a step without Python in between: in CasADi's virtual machine or compiled.

Both engines advance S in place and write a row (t0, t1, y0, y1, D) per accepted step.
"""

import ctypes
from dataclasses import dataclass
from enum import IntEnum
from string import Template
from typing import Any, Protocol, cast, final

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from symfric.foundation.numeric import flat_view
from symfric.integrator.compiled.compiler import load
from symfric.integrator.equations.initial import FLOOR
from symfric.integrator.running.crossings import Crossings
from symfric.integrator.running.events import Eventful, Happened, Search
from symfric.integrator.running.search import search_source
from symfric.integrator.step.layout import Given, State

Array = NDArray[np.float64]


class Stop(IntEnum):
    """Why an engine returned; the last three are what events ask for (`running.events`)."""

    END = 0
    FULL = 1
    ATTEMPTS = 2
    STEP_TOO_SMALL = 3
    TERMINAL = 4
    STORM = 5
    FOLLOW = 6


class Engine(Protocol):
    """Runs attempts until the end time, a full record, a number of attempts or a tiny step."""

    @property
    def name(self) -> str:
        """What ran: vm or compiled."""
        ...

    def run(
        self,
        S: Array,
        R: Array,
        rows: int,
        attempts: int,
        h_min: float,
        events: Eventful | None = None,
    ) -> tuple[Array, int, Stop]:
        """Advance S; return the records, the attempts made and why it stopped.

        A step that fell below `h_min`, or below what rounding leaves of t (`FLOOR`), stops it.
        With `events` these are carried out on the way.
        """
        ...


def width(n: int, dense_rows: int) -> int:
    """Length of a record row."""
    return 2 + 2 * n + dense_rows * n


@final
@dataclass(frozen=True, eq=False)
class VmEngine:
    """Attempts in CasADi's virtual machine, in batches of one call; needs no compiler.

    The same attempts as in the compiled loop, to the bit: both evaluate one graph operation by
    operation, each rounded once (`compiled.compiler.FLAGS`), with one library of functions.
    """

    step: ca.Function
    batch: ca.Function
    name: str = "vm"

    @classmethod
    def of(cls, step: ca.Function, size: int = 32) -> "VmEngine":
        """The engine for a step Function."""
        return cls(step, step.mapaccum("batch", size))

    def run(
        self,
        S: Array,
        R: Array,
        rows: int,
        attempts: int,
        h_min: float,
        events: Eventful | None = None,
    ) -> tuple[Array, int, Stop]:
        """Advance S; return the records, the attempts made and why it stopped."""
        size, search = self.batch.size2_out(0), None if events is None else Search(events)
        n = S.size - State.MEMORY
        S_out, D = np.zeros((size, S.size)), np.zeros((size, self.step.numel_out(1)))
        every = np.tile(R, size)
        buffer, evaluate = cast(tuple[Any, Any], self.batch.buffer())
        buffer.set_arg(0, flat_view(S))
        buffer.set_arg(1, flat_view(every))
        buffer.set_res(0, flat_view(S_out))
        if D.size:
            buffer.set_res(1, flat_view(D))
        found: list[Array] = []
        count = made = 0
        t_end = R[Given.T_END]
        surely = max(h_min, FLOOR * max(abs(t_end), abs(S[State.T])))
        asked = Happened.NOTHING
        while S[State.T] < t_end and count < rows and made < attempts and _large(S, h_min).all():
            if asked or (events is not None and events.full):
                break
            evaluate()
            before = np.vstack([S, S_out[:-1]])
            took = S_out[:, State.T] > before[:, State.T]
            used = size
            if not (
                S_out[-1, State.T] < t_end
                and S_out[:, State.H].min() >= surely
                and size <= min(rows - count, attempts - made)
            ):  # a batch goes beyond what the compiled loop would do: that is not taken
                room = np.cumsum(took) - took < rows - count
                goes = (before[:, State.T] < t_end) & _large(before, h_min) & room
                used = min(size if goes.all() else int(np.argmin(goes)), attempts - made)
                took[used:] = False
            found.append(
                np.hstack(
                    [
                        before[took, State.T, None],
                        S_out[took, State.T, None],
                        before[took, State.Y],
                        S_out[took, State.Y],
                        D[took],
                    ]
                )
            )
            if search is not None:
                found[-1], used, asked = _searched(search, found[-1], S_out, (took, used), R, count)
            count += found[-1].shape[0]
            made += used
            S[:] = S_out[used - 1]
        records = np.vstack(found) if found else np.zeros((0, width(n, D.shape[1] // n)))
        full = count >= rows or (events is not None and events.full)
        return records, made, Stop(asked) if asked else _reason(S, R, full, h_min)


def _searched(
    search: Search,
    records: Array,
    S_out: Array,
    attempts: tuple[NDArray[np.bool_], int],
    R: Array,
    count: int,
) -> tuple[Array, int, Happened]:
    """Records of a batch up to the first events in it, how many attempts, what events ask for.

    Args:
        records, S_out: of the batch; the attempt that led to events goes on behind them.
        attempts: which were accepted, and how many count.
        R: what was given.
        count: records before the batch.
    """
    took, used = attempts
    for i, k in enumerate(np.flatnonzero(took)):
        change, asked = search(records[i], S_out[k], R, count + i)
        if change:
            return records[: i + (change > 0)], int(k) + 1, asked
    return records, used, Happened.NOTHING


def _large(S: Array, h_min: float) -> NDArray[np.bool_]:
    """Whether the steps of columns S (..., MEMORY + n) are large enough to go on; NaN is not."""
    return S[..., State.H] >= np.maximum(h_min, FLOOR * np.abs(S[..., State.T]))


def _reason(S: Array, R: Array, full: bool, h_min: float) -> Stop:
    if S[State.T] >= R[Given.T_END]:
        return Stop.END
    if not _large(S, h_min).all():
        return Stop.STEP_TOO_SMALL
    return Stop.FULL if full else Stop.ATTEMPTS


@final
@dataclass(frozen=True, eq=False)
class CompiledEngine:
    """Attempts in a compiled loop around the generated C of the step; releases the GIL."""

    library: ctypes.CDLL
    row: int
    name: str = "compiled"

    @classmethod
    def of(
        cls, step: ca.Function, dense_rows: int, crossings: Crossings | None = None
    ) -> "CompiledEngine":
        """Compile the step and the search for events, or load them from the cache."""
        source = c_source(step, dense_rows, crossings=crossings)
        return cls.of_source(source, step.numel_in(0) - State.MEMORY, dense_rows)

    @classmethod
    def of_source(cls, source: str, n: int, dense_rows: int) -> "CompiledEngine":
        """The engine of generated C, for `n` unknowns."""
        library = load(source, "symfric_run")
        library.symfric_run.restype = ctypes.c_int
        library.symfric_run.argtypes = [
            *[ctypes.c_void_p] * 3,
            *[ctypes.c_longlong] * 2,
            ctypes.c_double,
            *[ctypes.c_void_p] * 3,
            ctypes.c_longlong,
        ]
        return cls(library, width(n, dense_rows))

    def run(
        self,
        S: Array,
        R: Array,
        rows: int,
        attempts: int,
        h_min: float,
        events: Eventful | None = None,
    ) -> tuple[Array, int, Stop]:
        """Advance S; return the records, the attempts made and why it stopped."""
        records = np.empty((rows, self.row))
        counts = np.zeros(3, dtype=np.int64)
        reason = self.library.symfric_run(
            S.ctypes.data,
            R.ctypes.data,
            records.ctypes.data,
            rows,
            attempts,
            h_min,
            counts.ctypes.data,
            *((0, 0, 0) if events is None else events.pointers),
        )
        if events is not None:
            events.count = int(counts[2])
        return records[: counts[0]], int(counts[1]), Stop(reason)


def c_source(
    step: ca.Function,
    dense_rows: int,
    *others: ca.Function,
    crossings: Crossings | None = None,
) -> str:
    """C of the step as CasADi generates it, with the loop that calls it until it must stop.

    `others` are Functions that further C calls by their names. A model without events has nothing
    of the search for them in its code.
    """
    n = step.numel_in(0) - State.MEMORY
    generator = ca.CodeGenerator("symfric_step.c", {"static_aux": True})
    called = (step, *(crossings.functions if crossings else ()))
    for function in (*called, *others):
        generator.add(function)
    hooks = dict.fromkeys(_HOOKS, "")
    if crossings is not None:
        places = {"d": step.numel_in(1) - crossings.data, "jump": crossings.width}
        hooks = {name: Template(code).substitute(places) for name, code in _HOOKS.items()}
    return (
        generator.dump()
        + search_source(crossings)
        + Template(_LOOP).substitute(
            n=n,
            memory=State.MEMORY,
            t=State.T,
            h=State.H,
            t_end=Given.T_END,
            width=width(n, dense_rows),
            dense=2 + 2 * n,
            dense_rows=dense_rows,
            floor=repr(FLOOR),
            arg=step.sz_arg(),
            res=step.sz_res(),
            iw=max(1, *(f.sz_iw() for f in called)),
            w=max(1, *(f.sz_w() for f in called)),
            **hooks,
        )
    )


_LOOP = """
/* Attempts from S towards R[T_END]; a row (t0, t1, y0, y1, D) per accepted step. */
int symfric_run(double *S, const double *R, double *rows, long long max_rows,
                long long max_attempts, double h_min, long long *counts$parameters)
{
  enum { N = $n, MEM = $memory, WIDTH = $width, T = $t, H = $h, T_END = $t_end };
  double next[MEM + N], w[$w];
  casadi_int iw[$iw];
  const double *arg[$arg];
  double *res[$res];
  long long i, count = 0, made = 0;$variables
  while (S[T] < R[T_END] && count < max_rows && made < max_attempts
         && S[H] >= h_min && S[H] >= $floor * fabs(S[T])$condition) {
    double *row = rows + count * WIDTH;
    arg[0] = S;
    arg[1] = R;
    res[0] = next;
    res[1] = row + $dense;
    symfric_step(arg, res, iw, w, 0);
    ++made;
    if (next[T] > S[T]) {
      row[0] = S[T];
      row[1] = next[T];
      for (i = 0; i < N; ++i) {
        row[2 + i] = S[MEM + i];
        row[2 + N + i] = next[MEM + i];
      }
      ++count;$search
    }
    for (i = 0; i < MEM + N; ++i) S[i] = next[i];
  }
  counts[0] = count;
  counts[1] = made;$found
  if (S[T] >= R[T_END]) return 0;
  if (!(S[H] >= h_min && S[H] >= $floor * fabs(S[T]))) return 3;
  return count >= max_rows$full ? 1 : 2;
}
"""

_HOOKS = {
    "parameters": """,
                double *memory, double *jumps, long long max_jumps""",
    "variables": """
  long long jumped = 0;
  int stop = 0, happened;""",
    "condition": """
         && jumped < max_jumps && !stop""",
    "search": """
      happened = symfric_search(row, next, R + $d, memory, jumps + jumped * $jump, count - 1,
                                iw, w, &stop);
      jumped += happened != 0;
      count -= happened < 0;""",
    "found": """
  counts[2] = jumped;
  if (stop) return stop;""",
    "full": " || jumped >= max_jumps",
}
"""What a model with events adds to the loop."""
