"""The compiled loop around the step, in pieces of C: attempts, outputs, input intervals.

`attempts` makes steps with one set of run data; `march` goes with it from input interval to input
interval and writes the unknowns at the times of the result on the way. What it needs stands in one
struct, so that a call from Python hands over one address (`Work`).
"""

import ctypes
from string import Template
from typing import final

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from symfric.foundation.numeric import address
from symfric.integrator.equations.following import Following
from symfric.integrator.equations.initial import FLOOR
from symfric.integrator.running.crossings import Crossings
from symfric.integrator.running.dense import Outputs
from symfric.integrator.running.events import Eventful
from symfric.integrator.running.search import search_source
from symfric.integrator.step.layout import Given, State

Array = NDArray[np.float64]
MOST_ROWS, LEAST_ROWS, BYTES = 2048, 64, 2**20
"""Accepted steps that a buffer holds, and its size in memory, which is kept between runs."""


def width(n: int, dense_rows: int) -> int:
    """Length of a record row (t0, t1, y0, y1, D)."""
    return 2 + 2 * n + dense_rows * n


class Loop(ctypes.Structure):
    """`symfric_loop` of the C below, field by field."""

    _fields_ = (
        *(
            (name, ctypes.c_void_p)
            for name in ("S", "R", "rows", "times", "out", "breaks", "data", "memory", "jumps")
        ),
        ("h_min", ctypes.c_double),
        *(
            (name, ctypes.c_longlong)
            for name in ("max_rows", "max_attempts", "max_jumps", "n_times", "found", "intervals",
                         "interval", "n_data", "count", "made", "jumped")
        ),
    )  # fmt: skip


@final
class Work:
    """The numbers of one run under way, where engines find them; used again by later runs.

    Attributes:
        S, R: the step's memory and unknowns, and what an attempt does not change.
        rows: buffer of records.
        loop: counters, limits and addresses.
        outputs: what is wanted at given times.
        events: what is remembered of events; None of a model without any.
    """

    def __init__(self, n: int, given: int, dense_rows: int, rows: int | None = None) -> None:
        self.n = n
        if rows is None:
            rows = max(LEAST_ROWS, min(MOST_ROWS, BYTES // (8 * width(n, dense_rows))))
        self.S, self.R = np.zeros(State.MEMORY + n), np.zeros(given)
        self.rows = np.empty((rows, width(n, dense_rows)))
        self.loop = Loop(
            S=self.S.ctypes.data, R=self.R.ctypes.data, rows=self.rows.ctypes.data, max_rows=rows
        )
        self.address = ctypes.addressof(self.loop)
        self.outputs: Outputs = Outputs.at(np.zeros(0), n)
        self.events: Eventful | None = None
        self.breaks, self.data = np.zeros(2), np.zeros((0, 1))

    def over(self, breaks: Array, data: Array) -> None:
        """Go over input intervals between `breaks` (k + 1,), with `data` (n_data, k) on each."""
        loop, self.breaks, self.data = self.loop, breaks, data
        loop.intervals, loop.n_data = breaks.size - 1, data.shape[0]
        if breaks.size > 2:
            self.breaks, self.data = np.ascontiguousarray(breaks), np.ascontiguousarray(data)
            loop.breaks, loop.data = self.breaks.ctypes.data, self.data.ctypes.data
        self.enter(0)

    def enter(self, interval: int) -> None:
        """Begin an input interval: its end and its data."""
        self.loop.interval = interval
        self.R[Given.T_END] = self.breaks[interval + 1]
        if self.data.shape[0]:
            self.R[-self.data.shape[0] :] = self.data[:, interval]

    def want(self, outputs: Outputs, events: Eventful | None) -> None:
        """Fill `outputs`, and carry out `events`."""
        loop, self.outputs, self.events = self.loop, outputs, events
        loop.n_times = outputs.times.size
        loop.times, loop.out = address(outputs.times), address(outputs.values)
        if events is not None:
            loop.memory, loop.jumps, loop.max_jumps = events.pointers


def c_source(
    step: ca.Function,
    dense_rows: int,
    *others: ca.Function,
    crossings: Crossings | None = None,
) -> str:
    """C of the step as CasADi generates it, with the attempts that call it until they must stop.

    `others` are Functions that further C calls by their names. A model without events has nothing
    of the search for them in its code.
    """
    generator = ca.CodeGenerator("symfric_step.c", {"static_aux": True})
    for function in (step, *(crossings.functions if crossings else ()), *others):
        generator.add(function)
    attempts = Template(ATTEMPTS).substitute(_numbers(step, dense_rows, crossings))
    return generator.dump() + search_source(crossings, step.numel_in(1)) + attempts


def loop_source(
    step: ca.Function,
    dense_rows: int,
    crossings: Crossings | None = None,
    follows: bool = False,
    follow: Following | None = None,
) -> str:
    """C of the whole loop.

    Args:
        step, dense_rows: one attempt.
        crossings: events.
        follows: whether there are algebraic unknowns, which follow a jump of inputs.
        follow: how; where it is left out, the loop returns at each jump, and at each event.
    """
    numbers = _numbers(step, dense_rows, crossings)
    numbers |= {"followed": "\n      return 7;" if follows else "", "settled": ""}
    if follow is not None:
        data = step.numel_in(1) - follow.round.numel_in(1)
        call = f"symfric_follow(L->S + {State.MEMORY}, L->R + {data})"
        numbers["followed"] = f"\n      if ({call}) return 7;"
        if crossings is not None and not crossings.closes:
            place = {"call": call, "jump": crossings.width}
            numbers["settled"] = Template(SETTLED).substitute(numbers, **place)
    pieces = Template(STRUCT + OUTPUTS + MARCH).substitute(numbers)
    others = () if follow is None else (follow.round,)
    jump = "" if follow is None else follow.c_source
    return c_source(step, dense_rows, *others, crossings=crossings) + jump + pieces


def _numbers(
    step: ca.Function, dense_rows: int, crossings: Crossings | None
) -> dict[str, str | int]:
    """What the C below leaves open."""
    n, given = step.numel_in(0) - State.MEMORY, step.numel_in(1)
    called = (step, *(crossings.functions if crossings else ()))
    hooks = dict.fromkeys(EVENTS, "")
    if crossings is not None:
        place = {"jump": crossings.width}
        hooks = {name: Template(code).substitute(place) for name, code in EVENTS.items()}
    return hooks | {
        "n": n,
        "memory": State.MEMORY,
        "t": State.T,
        "h": State.H,
        "t_end": Given.T_END,
        "given": given,
        "width": width(n, dense_rows),
        "dense": 2 + 2 * n,
        "dense_rows": dense_rows,
        "floor": repr(FLOOR),
        "arg": step.sz_arg(),
        "res": step.sz_res(),
        "iw": max(1, *(f.sz_iw() for f in called)),
        "w": max(1, *(f.sz_w() for f in called)),
    }


ATTEMPTS = """
/* Attempts from S towards R[T_END]; a row (t0, t1, y0, y1, D) per accepted step. */
static int symfric_run(double *S, const double *R, double *rows, long long max_rows,
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

EVENTS = {
    "parameters": """,
                       double *memory, double *jumps, long long max_jumps""",
    "variables": """
  long long jumped = 0;
  int stop = 0, happened;""",
    "condition": """
         && jumped < max_jumps && !stop""",
    "search": """
      happened = symfric_search(row, next, R, memory, jumps + jumped * $jump, count - 1, iw, w,
                                &stop);
      jumped += happened >= CUT;
      count -= happened == DROPPED;""",
    "found": """
  counts[2] = jumped;
  if (stop) return stop;""",
    "full": " || jumped >= max_jumps",
    "handed": """,
                       L->memory, L->jumps + L->jumped * $jump, L->max_jumps - L->jumped""",
    "noted": """
    for (i = 0; i < counts[2]; ++i) L->jumps[(L->jumped + i) * $jump] += (double)L->count;
    L->jumped += counts[2];""",
    "entered": """
      if (L->memory[PHASE] == ON) L->memory[PHASE] = JUMPED;""",
    "no_room": " || L->jumped == L->max_jumps",
}
"""What a model with events adds to the attempts, and to what calls them."""

SETTLED = """
    if (stop == 6 && !$call) {
      double *after = L->jumps + (L->jumped - 1) * $jump + 2 + $n;
      for (i = 0; i < $n; ++i) after[i] = L->S[$memory + i];
      stop = 1;
    }"""
"""Algebraic unknowns behind an event; where they have to be searched for, the loop returns."""

STRUCT = """
/* A run under way: buffers, limits, and how far it is. */
typedef struct {
  double *S, *R, *rows;
  const double *times;
  double *out;
  const double *breaks, *data;
  double *memory, *jumps;
  double h_min;
  long long max_rows, max_attempts, max_jumps, n_times, found, intervals, interval, n_data;
  long long count, made, jumped;
} symfric_loop;
"""

OUTPUTS = """
/* Unknowns at the times within an accepted step, out[unknown][time]; at its end if it is last. */
static void symfric_outputs(symfric_loop *L, const double *row, int last)
{
  enum { N = $n, ROWS = $dense_rows };
  long long i, r;
  for (; L->found < L->n_times; ++L->found) {
    const double time = L->times[L->found];
    double s;
    if (!(time < row[1] || (last && time == row[1]))) return;
    s = (time - row[0]) / (row[1] - row[0]);
    for (i = 0; i < N; ++i) {
      double bend = 0.;
      for (r = ROWS - 1; r >= 0; --r) bend = row[2 + 2 * N + r * N + i] + s * bend;
      L->out[i * L->n_times + L->found] =
          (1. - s) * row[2 + i] + s * (row[2 + N + i] + (1. - s) * bend);
    }
  }
}
"""

MARCH = """
/* Steps over all input intervals, up to a full record, a number of attempts, a tiny step, or what
   events ask for; 7 where algebraic unknowns have to be searched for behind a jump of inputs. */
int symfric_march(symfric_loop *L)
{
  enum { WIDTH = $width, T_END = $t_end, GIVEN = $given };
  L->count = L->made = L->jumped = 0;
  for (;;) {
    double *row = L->rows + L->count * WIDTH;
    long long counts[3], i;
    int stop = symfric_run(L->S, L->R, row, 1, L->max_attempts - L->made, L->h_min, counts$handed);
    L->made += counts[1];$noted$settled
    if (counts[0]) {
      ++L->count;
      symfric_outputs(L, row, stop == 0 && L->interval + 1 == L->intervals);
    }
    if (stop >= 3) return stop;
    if (stop == 0) {
      if (L->interval + 1 == L->intervals) return 0;
      ++L->interval;
      L->R[T_END] = L->breaks[L->interval + 1];
      for (i = 0; i < L->n_data; ++i)
        L->R[GIVEN - L->n_data + i] = L->data[i * L->intervals + L->interval];$entered$followed
    }
    if (L->count == L->max_rows$no_room) return 1;
    if (L->made == L->max_attempts) return 2;
  }
}
"""
