"""Solvers Ipopt, fatrop and SQP with exact derivatives, and the status of their return codes."""

from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from itertools import pairwise
from typing import Any, ClassVar, NamedTuple, Self, final

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from ocp.formulation.phase import Array
from ocp.solving.prepared import OVERDETERMINED, Built, Option, Prepared, reason_of, refused_options
from ocp.solving.watch import GradientHook, IterationHook, Shaped
from ocp.transcription.blocks import Indices
from ocp.transcription.program import Program
from symfric.foundation import checks
from symfric.foundation.status import Status

MULTIPLIERS = ["x", "p", "lam_f", "lam_g"]


def symmetric(triangle: ca.MX) -> ca.MX:
    """Return the symmetric matrix of an upper triangle.

    Each nonzero of the result is a nonzero of the triangle; no arithmetic is necessary.
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
    """Return (x, p, lam_f, lam_g) -> gradient and Hessian of lam_f f + lam_g' g, for fatrop."""
    x, p, lam_f, lam_g = _symbols(program)
    slope = lam_f * program.gradient(x, p)[1] + program.jacobian(x, p)[1].T @ lam_g
    results = [ca.densify(slope), symmetric(program.hessian(x, p, lam_f, lam_g))]
    names = ["grad_gamma_x", "hess_gamma_x_x"]
    return ca.Function("nlp_hess_l", [x, p, lam_f, lam_g], results, MULTIPLIERS, names)


def gradients(program: Program) -> ca.Function:
    """Return (x, p, lam_f, lam_g) -> f, g, gradients of lam_f f + lam_g' g in x and in p (zero)."""
    x, p, lam_f, lam_g = _symbols(program)
    f, slope = program.gradient(x, p)
    g, jacobian = program.jacobian(x, p)
    total = ca.densify(lam_f * slope + jacobian.T @ lam_g)
    names = ["f", "g", "grad_gamma_x", "grad_gamma_p"]
    zero = ca.MX.zeros(p.numel())
    return ca.Function("nlp_grad", [x, p, lam_f, lam_g], [f, g, total, zero], MULTIPLIERS, names)


def both(program: Program) -> ca.Function:
    """Return (x, p) -> f, its gradient, g and its Jacobian, for SQP."""
    x, p = _symbols(program)[:2]
    outputs = [*program.gradient(x, p), *program.jacobian(x, p)]
    outputs[1] = ca.densify(outputs[1])
    names = ["f", "grad_f_x", "g", "jac_g_x"]
    return ca.Function("nlp_jac_fg", [x, p], outputs, MULTIPLIERS[:2], names)


FLOOR = 1e-8
"""Smallest eigenvalue of a convexified block, relative to its largest eigenvalue."""


class _Size(NamedTuple):
    """Blocks of the same size n, with the sources and targets of their entries.

    Attributes:
        share: factor of each entry, shape (blocks, n, n), which divides entries that are common to
            several blocks between them.
        source: index of each entry in the nonzeros of the triangle; their number for zero entries.
        target: index of each entry in the nonzeros of the result.
    """

    share: Array
    source: Indices
    target: Indices


@final
class Convexified(Shaped):
    """Function (x, p, lam_f, lam_g) -> positive semidefinite Hessian of the Lagrangian.

    Negative eigenvalues of the blocks of the exact Hessian are replaced by small positive ones.
    """

    def __init__(self, program: Program) -> None:
        self._hessian = program.hessian
        hubs = np.array([not np.isfinite(place.fraction) for place in program.unknowns])
        self._sizes, self._pattern = _plan(program.hessian.sparsity_out(0), hubs)
        inputs = [program.hessian.sparsity_in(i) for i in range(len(MULTIPLIERS))]
        super().__init__("nlp_hess_l", inputs, self._pattern)

    def eval(self, arg: Sequence[ca.DM]) -> list[ca.DM]:  # noqa: D102
        triangle = np.append(np.array(self._hessian(*arg).nonzeros()), 0.0)
        result = np.zeros(self._pattern.nnz())
        for size in self._sizes:
            blocks = _clipped(triangle[size.source] * size.share)
            np.add.at(result, size.target.ravel(), blocks.ravel())
        return [ca.DM(self._pattern, result)]


def _clipped(blocks: Array) -> Array:
    """Return V max(L, FLOOR max L) V' of each symmetric block V L V', shape (k, n, n)."""
    if not np.isfinite(blocks).all():
        return blocks
    values, vectors = np.linalg.eigh(blocks)
    values = np.maximum(values, FLOOR * values.max(axis=1, keepdims=True, initial=0.0))
    return (vectors * values[:, None, :]) @ np.swapaxes(vectors, 1, 2)


def _plan(triangle: ca.Sparsity, hubs: NDArray[np.bool_]) -> tuple[list[_Size], ca.Sparsity]:
    """Return the blocks of a symmetric matrix by size, and the sparsity of their sum."""
    n = triangle.size1()
    rows, columns = (np.array(part, np.int64) for part in triangle.get_triplet())
    pairs = zip(rows.tolist(), columns.tolist(), strict=True)
    number = {pair: k for k, pair in enumerate(pairs)}
    border = np.flatnonzero(hubs)
    groups = _groups(rows, columns, hubs, n) or [np.zeros(0, np.int64)]
    blocks = [np.concatenate([group, border]).tolist() for group in groups]
    entries = {(i, j) for block in blocks for i in block for j in block}
    ordered = sorted(entries, key=lambda e: (e[1], e[0]))
    pattern = ca.Sparsity.triplet(n, n, [e[0] for e in ordered], [e[1] for e in ordered])
    place = {entry: k for k, entry in enumerate(ordered)}
    sizes: list[_Size] = []
    for size in dict.fromkeys(map(len, blocks)):
        alike = [block for block in blocks if len(block) == size]
        source = [[[number.get((min(i, j), max(i, j)), rows.size) for j in block] for i in block]
                  for block in alike]  # fmt: skip
        target = [[[place[i, j] for j in block] for i in block] for block in alike]
        share, own = np.ones((len(alike), size, size)), size - border.size
        share[:, own:, own:] = 1.0 / len(groups)
        indices = (np.array(part, np.int64).reshape(share.shape) for part in (source, target))
        sizes.append(_Size(share, *indices))
    return sizes, pattern


def _groups(rows: Indices, columns: Indices, hubs: NDArray[np.bool_], n: int) -> list[Indices]:
    """Return the groups of coupled unknowns, without hubs and unknowns that have no entry."""
    inside = ~hubs[rows] & ~hubs[columns]
    graph = ca.Sparsity.triplet(n, n, rows[inside].tolist(), columns[inside].tolist())
    _, order, offsets = (graph + graph.T + ca.Sparsity.diag(n)).scc()
    listed, known = np.array(order, np.int64), {*rows.tolist(), *columns.tolist()}
    parts = [np.sort(listed[a:b]) for a, b in pairwise(offsets)]
    return [part for part in parts if not hubs[part[0]] and (part.size > 1 or part[0] in known)]


ANSWERS: dict[str, dict[str, Status]] = {
    "Ipopt": {
        "Solve_Succeeded": Status.SOLVED,
        "Feasible_Point_Found": Status.SOLVED,
        "Solved_To_Acceptable_Level": Status.ACCEPTABLE,
        "Infeasible_Problem_Detected": Status.INFEASIBLE,
        OVERDETERMINED: Status.INFEASIBLE,
        "Maximum_Iterations_Exceeded": Status.MAX_ITERATIONS,
        "Maximum_CpuTime_Exceeded": Status.TIME_LIMIT,
        "Maximum_WallTime_Exceeded": Status.TIME_LIMIT,
        "User_Requested_Stop": Status.INTERRUPTED,
        "Invalid_Number_Detected": Status.NOT_FINITE,
        "Restoration_Failed": Status.NO_STEP,
        "Search_Direction_Becomes_Too_Small": Status.NO_STEP,
        "Error_In_Step_Computation": Status.NO_STEP,
        "Diverging_Iterates": Status.UNBOUNDED,
    },
    "Fatrop": {  # in the order of its return flags
        "Success": Status.SOLVED,
        "Maximum_Iterations_Exceeded": Status.MAX_ITERATIONS,
        "Stop_At_Tiny_Step": Status.NO_STEP,
        "Stop_At_Acceptable_Point": Status.ACCEPTABLE,
        "Local_Infeasibility": Status.INFEASIBLE,
    },
    "Sqp": {
        "Solve_Succeeded": Status.SOLVED,
        "Maximum_Iterations_Exceeded": Status.MAX_ITERATIONS,
        "Search_Direction_Becomes_Too_Small": Status.NO_STEP,
        "User_Requested_Stop": Status.INTERRUPTED,
    },
}
"""Solver -> return code -> status; other return codes have the status SOLVER_FAILED."""

LEAN: dict[str, Option] = {
    "print_time": False,
    "show_eval_warnings": False,
    "calc_lam_p": False,
    "no_nlp_grad": True,
}
"""Options of all solvers for no output and no unused derivatives."""
QUIET: dict[str, Option] = {"print_level": 0, "sb": "yes", "mumps_mem_percent": 5}
"""Options of Ipopt for no output, and of MUMPS for its first estimate of the memory, which it
doubles if necessary: by default it allocates eleven times the estimate, in each factorisation."""
WARM: dict[str, Option] = {
    "warm_start_init_point": "yes",
    "mu_init": 1e-6,
    "warm_start_bound_push": 1e-9,
    "warm_start_bound_frac": 1e-9,
    "warm_start_slack_bound_push": 1e-9,
    "warm_start_slack_bound_frac": 1e-9,
    "warm_start_mult_bound_push": 1e-9,
}
"""Options of Ipopt for a start with multipliers; the user's options take precedence."""
SQP: dict[str, Option] = {
    "print_header": False,
    "print_iteration": False,
    "print_status": False,
    "max_iter": 300,
}
"""Options of sqpmethod."""
QP: dict[str, dict[str, Option]] = {
    "qrqp": {"print_iter": False, "print_header": False, "print_info": False},
}
"""QP solver -> options that suppress its output."""


@dataclass(frozen=True, eq=False, init=False)
class _Method(ABC):
    """Solver with options by name."""

    options: Mapping[str, Option]
    max_time: float | None
    plugin: ClassVar[str]

    def __init__(self, *, max_time: float | None = None, **options: Option) -> None:
        name = type(self).__name__
        for option, value in options.items():
            if not isinstance(value, str | float | int):  # pyright: ignore[reportUnnecessaryIsInstance]
                raise checks.refused(f"{name}: option {option}", "a number or a text", value)
        if max_time is not None:
            max_time = checks.number(f"{name}: max_time", max_time, unit="s", above=0.0)
        object.__setattr__(self, "options", options)
        object.__setattr__(self, "max_time", max_time)

    def with_options(self, **options: Option) -> Self:
        """Return the solver with additional or changed options."""
        return type(self)(max_time=self.max_time, **(dict(self.options) | options))

    def with_defaults(self, **options: Option) -> Self:
        """Return Ipopt with options that the user's options override, or another solver as is."""
        if self.plugin != "ipopt":
            return self
        return self.with_options(**(options | dict(self.options)))

    def prepared(self, program: Program) -> Prepared:
        """Return the solver prepared for `program`.

        Raises:
            ValueError: an unknown option (at the first run).
        """
        name, build = type(self).__name__, partial(self._build, program)
        return Prepared(program, name, self.options, build, self._read, self.max_time)

    @abstractmethod
    def _build(self, program: Program, warm: bool) -> Built:
        """Return the CasADi solver; `warm` is True for a start with multipliers."""

    def _made(self, program: Program, **common: Any) -> ca.Function:
        """Return the CasADi solver of `program`; the user's options override `common`."""
        prefix = "" if self.plugin == "sqpmethod" else f"{self.plugin}."
        own = {f"{prefix}{name}": value for name, value in self.options.items()}
        try:
            return ca.nlpsol("solver", self.plugin, program.nlp, LEAN | common | own)
        except (RuntimeError, NotImplementedError) as error:
            if not self.options:
                raise
            raise refused_options(type(self).__name__, self.options, reason_of(error)) from None

    def _read(self, stats: Mapping[str, Any]) -> tuple[str, Status]:
        """Return the return code of the solver and its status."""
        answer = str(stats["return_status"])
        return answer, ANSWERS[type(self).__name__].get(answer, Status.SOLVER_FAILED)


@final
@dataclass(frozen=True, eq=False, init=False)
class Ipopt(_Method):
    """Interior-point solver Ipopt with options by name: `Ipopt(max_iter=500, print_level=5)`.

    True and False are passed as "yes" and "no".

    Attributes:
        options: options of Ipopt; see its documentation.
        max_time: wall time [s] after which a solve ends with its best iterate, or None.

    Source: Waechter and Biegler, Mathematical Programming 106(1), 2006, 25-57.
    """

    plugin = "ipopt"

    def __init__(self, *, max_time: float | None = None, **options: Option) -> None:
        words = {True: "yes", False: "no"}
        given = {n: words[v] if isinstance(v, bool) else v for n, v in options.items()}
        super().__init__(max_time=max_time, **given)

    def _build(self, program: Program, warm: bool) -> Built:
        hook = IterationHook(program)
        own = {f"ipopt.{name}": value for name, value in (QUIET | (WARM if warm else {})).items()}
        function = self._made(program, **program.derivatives, iteration_callback=hook, **own)
        return Built(function, hook)


@final
@dataclass(frozen=True, eq=False, init=False)
class Fatrop(_Method):
    """Interior-point solver fatrop with options by name: `Fatrop(max_iter=500, mu_init=0.1)`.

    Fatrop factorises the program stage by stage, so unknowns may couple only neighbouring
    intervals. A free duration, a parameter chosen with the trajectory, scenarios and conditions
    between the two ends couple all intervals. Programs that contain them raise a `ValueError` with
    the reason; use `Ipopt`.

    Attributes:
        options: options of fatrop; see its documentation.
        max_time: wall time [s] after which a solve ends with its best iterate, or None.

    Limits: multipliers of a start are not used, and the best iterates of stopped solves have zero
    multipliers. CasADi 3.8 needs a time proportional to N^2 to set up the stages: 0.5 s at N = 200,
    16 s at N = 1000. Options must be numbers, because fatrop ignores other values silently.
    Source: Vanroye et al., FATROP, IROS 2023.
    """

    plugin = "fatrop"

    def __init__(self, *, max_time: float | None = None, **options: Option) -> None:
        for name, value in options.items():
            checks.number(f"Fatrop: option {name}", float(value) if value in (0, 1) else value)
        super().__init__(max_time=max_time, **options)

    def prepared(self, program: Program) -> Prepared:
        """Return the solver prepared for `program`.

        Raises:
            ValueError: the program has no stages, or an option is unknown (raised at the first
                run).
        """
        stages, reason = program.structure()
        if stages is None:
            raise ValueError(
                f"Fatrop: expected a program of stages, got one with {reason}; use Ipopt()"
            )
        return super().prepared(program)

    def _build(self, program: Program, warm: bool) -> Built:
        del warm
        hook, stages = GradientHook(program), program.structure()[0]
        sizes = {name: list(getattr(stages, name)) for name in ("nx", "nu", "ng")}
        derivatives = {
            "nlp_grad": gradients(program),
            "nlp_grad_f": hook,
            "nlp_jac_g": program.jacobian,
            "nlp_hess_l": lagrangian(program),
        }
        own = {"fatrop.print_level": 0, "structure_detection": "manual", "no_nlp_grad": False}
        N = len(sizes["nx"]) - 1
        return Built(self._made(program, **own, N=N, **sizes, cache=derivatives), hook)

    def _read(self, stats: Mapping[str, Any]) -> tuple[str, Status]:
        flag, answers = int(stats["fatrop"]["return_flag"]), [*ANSWERS["Fatrop"].items()]
        if 0 <= flag < len(answers):
            return answers[flag]
        return f"return flag {flag}", Status.SOLVER_FAILED


@final
@dataclass(frozen=True, eq=False, init=False)
class Sqp(_Method):
    """Sequential quadratic programming with options by name: `Sqp(max_iter=500, qpsol="qrqp")`.

    The solver is `sqpmethod` of CasADi. Its quadratic programs are solved by the interior-point
    method `piqp`, or by the solver that `qpsol` names. Its Hessian is the exact one with negative
    eigenvalues removed (`ocp.solving.methods`).

    Attributes:
        options: options of sqpmethod; see the documentation of CasADi.
        max_time: wall time [s] after which a solve ends with its best iterate, or None.

    Limits: convergence is linear where the exact Hessian is indefinite, and the method does not
    recover from contradictory linearised constraints. It is suited to starts near a solution. For
    motions with friction Ipopt takes fewer iterations.
    """

    plugin = "sqpmethod"

    def _build(self, program: Program, warm: bool) -> Built:
        del warm
        hook, hessian = IterationHook(program), Convexified(program)
        solver = str(self.options.get("qpsol", "piqp"))
        own = {"qpsol": solver, "qpsol_options": QP.get(solver, {}) | {"error_on_fail": False}}
        derivatives = {"nlp_jac_fg": both(program), "nlp_hess_l": hessian}
        function = self._made(program, **SQP, **own, iteration_callback=hook, cache=derivatives)
        return Built(function, hook, (hessian,))
