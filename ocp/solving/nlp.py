"""Nonlinear program of a problem as CasADi Functions, for solvers of the user."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, final

import casadi as ca
import numpy as np
from numpy.typing import ArrayLike

from ocp.formulation.phase import Array
from ocp.formulation.problem import Problem
from ocp.solving.motion import ScenarioMotion, motions_of
from ocp.solving.starts import Start, start_of
from ocp.transcription.schemes import Radau, Scheme, make_meshes
from ocp.transcription.transcribe import Transcription, discretise
from symfric.foundation import checks


@final
@dataclass(frozen=True, eq=False)
class Nlp:
    """Nonlinear program of a problem on a mesh; all values are scaled.

        min f(w, p)   subject to   lbx <= w <= ubx,   lbg <= g(w, p) <= ubg

    `ca.nlpsol("solver", "ipopt", nlp.symbols)(**nlp.arguments)` solves it, without the derivatives
    below.

    Attributes:
        transcription: the transcribed problem.
        x0: start, scaled, shape (n,).
    """

    transcription: Transcription
    x0: Array

    @property
    def symbols(self) -> dict[str, ca.MX]:
        """Symbols x and p and expressions f and g, as for `casadi.nlpsol`."""
        return self.transcription.program.nlp

    @property
    def functions(self) -> dict[str, ca.Function]:
        """Functions by the names of CasADi, with exact sparse derivatives.

        nlp_f: (x, p) -> f                nlp_grad_f: (x, p) -> f, gradient
        nlp_g: (x, p) -> g                nlp_jac_g: (x, p) -> g, Jacobian
        nlp_hess_l: (x, p, lam_f, lam_g) -> upper triangle of the Hessian of lam_f f + lam_g'g
        """
        program, names = self.transcription.program, ["x", "p"]
        own = {n: ca.Function(f"nlp_{n}", [program.w, program.p], [e], names, [n])
               for n, e in (("f", program.f), ("g", program.g))}  # fmt: skip
        every = (*own.values(), program.gradient, program.jacobian, program.hessian)
        return {function.name(): function for function in every}

    @property
    def arguments(self) -> dict[str, Array]:
        """Arguments x0, p, lbx, ubx, lbg and ubg of a solver of `casadi.nlpsol`."""
        program = self.transcription.program
        bounds = {"lbx": program.lower_w, "ubx": program.upper_w}
        bounds |= {"lbg": program.lower_g, "ubg": program.upper_g}
        return {"x0": self.x0, "p": program.values, **bounds}

    @property
    def scale(self) -> Array:
        """SI values of the unknowns divided by w, shape (n,)."""
        return self.transcription.program.scale

    @property
    def names(self) -> tuple[list[str], list[str]]:
        """Names and times of all unknowns and of all rows, such as "force at t = 0.1 s"."""
        made, program = self.transcription, self.transcription.program
        groups = program.unknowns, program.rows
        unknowns, rows = ([f"{p.name} {made.when(self.x0, p)}".strip() for p in g] for g in groups)
        return unknowns, rows

    def motion(self, w: ArrayLike) -> ScenarioMotion:
        """Return the motion of the unknowns `w`, of the first scenario.

        Raises:
            ValueError: a wrong number of values.
        """
        made, given = self.transcription, np.asarray(w, dtype=float).ravel()
        if given.size != self.x0.size:
            raise ValueError(f"motion: expected {self.x0.size} values of w, got {given.size}")
        coefficients = made.scheme.coefficients()
        return motions_of(made.problem, made.meshes, coefficients, made.unpack(given))[0]


def nlp_of(
    problem: Problem,
    *,
    scheme: Scheme | None = None,
    intervals: int | ArrayLike | Sequence[ArrayLike] = 50,
    guess: Start = None,
) -> Nlp:
    """Return the nonlinear program of `problem`, with its models unchanged.

    Args:
        problem: the problem.
        scheme, intervals, guess: as in `ocp.solve`.

    Raises:
        ValueError: bad input.

    Limits: friction remains smooth as in the law of the model, and the mesh is not refined.
    """
    made: Any = problem
    checks.kind("nlp_of", made, Problem, "a problem, such as Problem(Phase(model, T=1.0), cost)")
    transcription = discretise(problem, scheme or Radau()).on(make_meshes(problem, intervals))
    return Nlp(transcription, start_of(transcription, guess)[0].w)
