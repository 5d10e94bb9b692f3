from collections.abc import Callable

import casadi as ca
import numpy as np
import pytest
from discretised import CASES

from ocp.formulation.problem import Problem
from ocp.transcription.program import Program
from ocp.transcription.schemes import Legendre, Radau, Scheme, make_meshes
from ocp.transcription.transcribe import discretise


def program(problem: Problem, scheme: Scheme, intervals: int = 4) -> Program:
    return discretise(problem, scheme).on(make_meshes(problem, intervals)).program


def by_casadi(p: Program) -> ca.Function:
    """Derivatives of the graph of f and g as CasADi makes them, without our assembly."""
    sigma, lam = ca.MX.sym("sigma"), ca.MX.sym("lam", p.g.numel())
    hessian = ca.triu(ca.hessian(sigma * p.f + ca.dot(lam, p.g), p.w)[0])
    derivatives = [p.f, ca.gradient(p.f, p.w), p.g, ca.jacobian(p.g, p.w), hessian]
    return ca.Function("by_casadi", [p.w, p.p, sigma, lam], derivatives)


@pytest.mark.parametrize("scheme", [Radau(2), Legendre(3)], ids=["radau", "legendre"])
@pytest.mark.parametrize("make", CASES, ids=lambda make: make.__name__)
def test_derivatives_are_those_of_the_rows(make: Callable[[], Problem], scheme: Scheme) -> None:
    p = program(make(), scheme)
    rng = np.random.default_rng(0)
    w, lam = rng.uniform(0.5, 1.5, p.w.numel()), rng.standard_normal(p.g.numel())
    expected = by_casadi(p)(w, p.values, 0.7, lam)
    found = (*p.gradient(w, p.values), *p.jacobian(w, p.values), p.hessian(w, p.values, 0.7, lam))
    for ours, theirs in zip(found, expected, strict=True):
        assert ours.sparsity() == theirs.sparsity() or ours.is_dense()
        size = max(1.0, float(ca.norm_inf(ca.vec(ca.densify(theirs)))))
        np.testing.assert_allclose(ours.full() / size, theirs.full() / size, atol=1e-12)


def test_sparsity_is_not_larger_than_needed() -> None:
    for make in CASES:
        p = program(make(), Radau(2))
        sigma, lam = ca.MX.sym("sigma"), ca.MX.sym("lam", p.g.numel())
        hessian = ca.triu(ca.hessian(sigma * p.f + ca.dot(lam, p.g), p.w)[0])
        assert p.jacobian.nnz_out(1) == ca.jacobian(p.g, p.w).nnz()
        assert p.hessian.nnz_out(0) == hessian.nnz()
