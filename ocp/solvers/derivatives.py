"""The derivatives of a program in the forms that other solvers than Ipopt ask for."""

import casadi as ca
import numpy as np

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
