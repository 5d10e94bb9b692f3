"""Derivatives by several names side by side in the lanes of vector instructions.

A step by one name holds the step itself, the same for all names, and what is linear in the
derivatives. On vectors of a lane for each name the former costs what it costs alone, and the latter
is done for all names at once, in the same operations as one after another: with the same bits.
"""

from string import Template

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from symfric.integrator.compiled.columns import NAME
from symfric.integrator.many.vectors import lanes_header, vector_source

Array = NDArray[np.float64]
FEW, MANY = 4, 8
"""Lanes for up to as many names, and for more."""
ONE = (
    "exp", "expm1", "log", "log1p", "tan", "asin", "acos", "atan", "sinh", "cosh", "tanh", "asinh",
    "acosh", "atanh", "erf",
)  # fmt: skip
TWO = ("pow", "atan2", "hypot", "fmod", "remainder")
"""Functions that only what is the same in all lanes is an argument of: libm is asked once."""


def lanes_source(one: ca.Function, of_d: Array) -> str:
    """C of a sweep over rows (`compiled.rows`) by the names of `of_d`, shape (n_d, names).

    `one` is (X, y, h, d, d', ...) -> (X of the next step, column) of one name, where the last one
    of the further arguments, if there are any, is another one for each name, too. In the column of
    all names those of each name follow each other in parts as long as y.
    """
    text, slots = vector_source("symfric_one", one)
    names, sizes = of_d.shape[1], [one.numel_in(i) for i in range(one.n_in())]
    own = {0, len(sizes) - 1} if len(sizes) > 5 else {0}
    lanes = FEW if names <= FEW else MANY
    seeds = np.zeros((-(-names // lanes) * lanes, max(1, sizes[4])))
    seeds[:names, : sizes[4]] = of_d.T
    places = [i if i < 4 else i - 1 for i in range(len(sizes))]
    common = [i for i in range(len(sizes)) if i not in own and i != 4]
    return (
        lanes_header(lanes)
        + "".join(f"#define v_{f}(x) ALL({f}((x)[0]))\n" for f in ONE)
        + "".join(f"#define v_{f}(x, y) ALL({f}((x)[0], (y)[0]))\n" for f in TWO)
        + _ANGLES
        + text
        + Template(_LOOP).substitute(
            loop=NAME,
            names=names,
            x=sizes[0],
            n=sizes[1],
            column=one.numel_out(1),
            data=sizes[4],
            width=seeds.shape[1],
            seeds=", ".join(repr(x) for x in seeds.ravel().tolist()),
            symbols=", ".join(f"a{i}[{max(1, size)}]" for i, size in enumerate(sizes)),
            arguments=", ".join(f"a{i}" for i in range(len(sizes))),
            slots=max(1, slots),
            common="\n".join(
                f"    symfric_same(a{i}, in + {places[i]}, k, {sizes[i]});" for i in common
            ),
            own="\n".join(
                f"      symfric_lanes(a{i}, {_begin(i, places[i])}, {sizes[i]}, b);"
                for i in sorted(own)
            ),
        )
    )


def _begin(argument: int, place: int) -> str:
    """Address of the row of an argument that has another column for each name."""
    return "X" if argument == 0 else f"symfric_at(in + {place}, k)"


_ANGLES = """
#define v_sincos symfric_sincos
static inline V symfric_sincos(V x, V *other)
{
  *other = ALL(cos(x[0]));
  return ALL(sin(x[0]));
}
"""
_LOOP = """
enum { NAMES = $names, N = $n, X_SIZE = $x, COLUMN = $column };
typedef struct { char *at; long long apart; const long long *of; } symfric_place;
static const double symfric_seeds[] = { $seeds };

static const double *symfric_at(const symfric_place *p, long long k)
{
  return (const double *)(p->at + (p->of ? p->of[k] : k) * p->apart);
}

static void symfric_same(V *a, const symfric_place *p, long long k, int size)
{
  const double *x = symfric_at(p, k);
  int i;
  for (i = 0; i < size; ++i) a[i] = ALL(x[i]);
}

/* Columns of the names from b on, one in each lane. */
static void symfric_lanes(V *a, const double *x, int size, int b)
{
  int i, j;
  for (i = 0; i < size; ++i)
    for (j = 0; j < LANES; ++j) a[i][j] = b + j < NAMES ? x[(b + j) * size + i] : 0;
}

void $loop(long long count, int chained, const symfric_place *in, const symfric_place *out)
{
  V $symbols, next[X_SIZE], column[COLUMN], w[$slots];
  const V *arg[] = { $arguments };
  V *res[] = { next, column };
  const double *X = (const double *)in[0].at;
  long long k;
  int i, j, b;
  for (k = 0; k < count; ++k) {
    double *to = (double *)(out[0].at + k * out[0].apart);
    double *parts = (double *)(out[1].at + k * out[1].apart);
$common
    for (b = 0; b < NAMES; b += LANES) {
$own
      for (i = 0; i < $data; ++i)
        for (j = 0; j < LANES; ++j) a4[i][j] = symfric_seeds[(b + j) * $width + i];
      symfric_one(arg, res, w);
      for (j = 0; j < LANES && b + j < NAMES; ++j) {
        for (i = 0; i < X_SIZE; ++i) to[(b + j) * X_SIZE + i] = next[i][j];
        for (i = 0; i < COLUMN; ++i)
          parts[(i / N * NAMES + b + j) * N + i % N] = column[i][j];
      }
    }
    X = to;
  }
}
"""
