"""Derivatives of a program for fatrop and SQP, whose Hessian is made positive semidefinite.

The Hessian of a discretised motion is block diagonal but for the unknowns that belong to all of it:
a free duration, parameters chosen with the motion. Each block, bordered by its share of these, is
replaced by V max(L, 0) V' of its eigenvalues L; a sum of semidefinite blocks is semidefinite.
|L| in their place takes twice the iterations on moves against friction.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import final

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from ocp.transcription.program import Program

POINT = ["x", "p"]
MULTIPLIERS = ["x", "p", "lam_f", "lam_g"]


def symmetric(triangle: ca.MX) -> ca.MX:
    """The symmetric matrix of an upper triangle, by a gather of its nonzeros.

    Nothing is computed: every nonzero of the result is one of the triangle.
    """
    sparsity = triangle.sparsity()
    numbered = ca.DM(sparsity, np.arange(1.0, sparsity.nnz() + 1))
    both = numbered + numbered.T - ca.diag(ca.diag(numbered))
    which = np.array(both.nonzeros()).astype(int) - 1
    return ca.MX(both.sparsity(), triangle.nz[which.tolist()])


def _symbols(program: Program) -> list[ca.MX]:
    m = program.g.numel()
    sizes = {"x": program.w.numel(), "p": program.p.numel(), "lam_f": 1, "lam_g": m}
    return [ca.MX.sym(name, size) for name, size in sizes.items()]


def lagrangian(program: Program) -> ca.Function:
    """(x, p, lam_f, lam_g) -> gradient and whole Hessian of lam_f f + lam_g' g, for fatrop."""
    x, p, lam_f, lam_g = _symbols(program)
    slope = lam_f * program.gradient(x, p)[1] + program.jacobian(x, p)[1].T @ lam_g
    hessian = symmetric(program.hessian(x, p, lam_f, lam_g))
    return ca.Function(
        "nlp_hess_l",
        [x, p, lam_f, lam_g],
        [ca.densify(slope), hessian],
        MULTIPLIERS,
        ["grad_gamma_x", "hess_gamma_x_x"],
    )


def gradients(program: Program) -> ca.Function:
    """(x, p, lam_f, lam_g) -> f, g and the gradients of lam_f f + lam_g' g in x and in p.

    Those in p are zero: nobody asks for them, and CasADi wants a function that has them.
    """
    x, p, lam_f, lam_g = _symbols(program)
    f, slope = program.gradient(x, p)
    g, jacobian = program.jacobian(x, p)
    total = ca.densify(lam_f * slope + jacobian.T @ lam_g)
    names = ["f", "g", "grad_gamma_x", "grad_gamma_p"]
    zero = ca.MX.zeros(p.numel())
    return ca.Function("nlp_grad", [x, p, lam_f, lam_g], [f, g, total, zero], MULTIPLIERS, names)


def both(program: Program) -> ca.Function:
    """(x, p) -> f, its gradient, g and its Jacobian, for SQP."""
    x, p = _symbols(program)[:2]
    outputs = [*program.gradient(x, p), *program.jacobian(x, p)]
    outputs[1] = ca.densify(outputs[1])
    names = ["f", "grad_f_x", "g", "jac_g_x"]
    return ca.Function("nlp_jac_fg", [x, p], outputs, POINT, names)


Array = NDArray[np.float64]
Indices = NDArray[np.int64]

FLOOR = 1e-8
"""Smallest eigenvalue of a block as a share of its largest."""


@final
@dataclass(frozen=True, eq=False)
class _Size:
    """All blocks of the same size n: where they take their entries from and put them.

    Attributes:
        source: number of the triangle's nonzero of each entry, the number of nonzeros for none,
            shape (blocks, n, n).
        share: factor of each entry; what is common to several blocks is split between them.
        target: number of the result's nonzero of each entry.
    """

    source: Indices
    share: Array
    target: Indices


@final
class Convexified(ca.Callback):
    """(x, p, lam_f, lam_g) -> the whole Hessian of the Lagrangian, made positive semidefinite."""

    def __init__(self, program: Program) -> None:
        super().__init__()
        self._hessian = program.hessian
        hubs = np.array([not np.isfinite(place.fraction) for place in program.unknowns])
        self._sizes, self._pattern = _plan(program.hessian.sparsity_out(0), hubs)
        self._inputs = [program.hessian.sparsity_in(i) for i in range(4)]
        self.construct("nlp_hess_l", {})

    def get_n_in(self) -> int:  # noqa: D102
        return 4

    def get_n_out(self) -> int:  # noqa: D102
        return 1

    def get_name_in(self, i: int) -> str:  # noqa: D102
        return ("x", "p", "lam_f", "lam_g")[i]

    def get_name_out(self, i: int) -> str:  # noqa: D102
        del i
        return "hess_gamma_x_x"

    def get_sparsity_in(self, i: int) -> ca.Sparsity:  # noqa: D102
        return self._inputs[i]

    def get_sparsity_out(self, i: int) -> ca.Sparsity:  # noqa: D102
        del i
        return self._pattern

    def eval(self, arg: Sequence[ca.DM]) -> list[ca.DM]:  # noqa: D102
        triangle = np.append(np.array(self._hessian(*arg).nonzeros()), 0.0)
        result = np.zeros(self._pattern.nnz())
        for size in self._sizes:
            blocks = _clipped(triangle[size.source] * size.share)
            np.add.at(result, size.target.ravel(), blocks.ravel())
        return [ca.DM(self._pattern, result)]


def _clipped(blocks: Array) -> Array:
    """V max(L, 0) V' of each symmetric block (k, n, n)."""
    if not np.isfinite(blocks).all():
        return blocks
    values, vectors = np.linalg.eigh(blocks)
    values = np.maximum(values, FLOOR * values.max(axis=1, keepdims=True, initial=0.0))
    return (vectors * values[:, None, :]) @ np.swapaxes(vectors, 1, 2)


def _plan(triangle: ca.Sparsity, hubs: NDArray[np.bool_]) -> tuple[list[_Size], ca.Sparsity]:
    """The blocks of a symmetric matrix whose upper triangle is given, and the pattern they fill."""
    n = triangle.size1()
    rows, columns = (np.array(part, np.int64) for part in triangle.get_triplet())
    number = {
        (r, c): k for k, (r, c) in enumerate(zip(rows.tolist(), columns.tolist(), strict=True))
    }
    border = np.flatnonzero(hubs)
    groups = _groups(rows, columns, hubs, n) or [np.zeros(0, np.int64)]
    columns_of = [np.concatenate([group, border]) for group in groups]
    entries = {
        (int(i), int(j)) for block in columns_of for i in block for j in block
    }  # the pattern of all blocks
    ordered = sorted(entries, key=lambda e: (e[1], e[0]))
    pattern = ca.Sparsity.triplet(n, n, [e[0] for e in ordered], [e[1] for e in ordered])
    place = {entry: k for k, entry in enumerate(ordered)}
    sizes: dict[int, list[Indices]] = {}
    for block in columns_of:
        sizes.setdefault(block.size, []).append(block)
    none, parts = rows.size, len(groups)
    found: list[_Size] = []
    for size, blocks in sizes.items():
        source = np.full((len(blocks), size, size), none, np.int64)
        target = np.zeros_like(source)
        share = np.ones((len(blocks), size, size))
        own = size - border.size
        share[:, own:, own:] = 1.0 / parts
        for k, block in enumerate(blocks):
            for a, i in enumerate(block.tolist()):
                for b, j in enumerate(block.tolist()):
                    source[k, a, b] = number.get((min(i, j), max(i, j)), none)
                    target[k, a, b] = place[i, j]
        found.append(_Size(source, share, target))
    return found, pattern


def _groups(rows: Indices, columns: Indices, hubs: NDArray[np.bool_], n: int) -> list[Indices]:
    """Unknowns that are coupled with each other, hubs and unknowns without an entry apart."""
    inside = ~hubs[rows] & ~hubs[columns]
    touched = np.unique(np.concatenate([rows, columns]))
    graph = ca.Sparsity.triplet(n, n, rows[inside].tolist(), columns[inside].tolist())
    graph = graph + graph.T + ca.Sparsity.diag(n)
    _, order, offsets = graph.scc()
    listed = np.array(order, np.int64)
    parts = [np.sort(listed[a:b]) for a, b in pairwise(offsets)]
    known = set(touched.tolist())
    return [part for part in parts if not hubs[part[0]] and (part.size > 1 or part[0] in known)]
