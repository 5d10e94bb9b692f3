"""How the steps of blocks are made, in the words and formulas of a data sheet."""

from symfric.codegen.blocks.held_step import EVENT, EXACT, SECOND
from symfric.integrator.methods.explicit import Exponential
from symfric.integrator.methods.implicit import BackwardEuler, Radau, Rosenbrock
from symfric.integrator.methods.method import Method

HELD = "Inputs are held over the step h."

KINDS = {
    EXACT: """\
Exact exponential step, whatever its length, for dz/dt = a - b z at held inputs:
    x     = -b h,   phi1 = (exp(x) - 1) / x,   phi2 = (phi1 - 1) / x
    z+    = z + h phi1 dz/dt            at the end of the step
    zm    = z + h phi2 dz/dt            mean over the step
    r     = (z+ - z) / h                mean rate,   r+ = exp(x) dz/dt at the end""",
    EVENT: """\
Event step, exact whatever its length: every element sticks up to its limit, which it meets
within the step, and slips from there on; it sticks again when v turns round.
    z+, zm  at the end of the step, and mean over it
    r       = (z+ - z) / h              mean rate,   r+ = dz/dt at z+""",
    SECOND: """\
Exponential step of second order, bounded whatever its length, linearised in each state:
    J     = d(dz/dt)/dz,   x = J h,   phi1 = (exp(x) - 1) / x,   phi2 = (phi1 - 1) / x
    z+    = z + s h phi1 dz/dt          at the end of the step
    zm    = z + s h [(1 - s) phi1 + s phi2] dz/dt       mean over the step
    r     = (z+ - z) / h                mean rate,   r+ = exp(x) dz/dt at the end
s is 1, or the share of the way on which z comes to rest, where it stays, with r+ = 0.""",
}

FORCES = """\
    F     = F(v, N, zm, r)              mean over the step
    F_end = F(v, N, z+, r+)             at its end"""


def of_law(kinds: tuple[str, ...], ends: bool) -> str:
    """How the states of a law step, by the `kinds` of its `Step`.

    Args:
        ends: the block has the force at the end of the step, too.
    """
    forces = FORCES if ends else FORCES.splitlines()[0]
    return "\n".join([HELD, *(KINDS[kind] for kind in kinds), forces])


def of_method(method: Method, algebraic: bool) -> str:
    """How a method of the integrator makes a fixed step of x' = f(x, u), 0 = g(x, z, u).

    Args:
        algebraic: there are unknowns z.
    """
    unknowns = "\n    x stands for states and algebraic unknowns" if algebraic else ""
    return (
        f"Fixed steps by {method.name}, order {method.order}. {HELD}\n"
        f"{_formula(method)}{unknowns}\n"
        "Outputs are those at the end of the step. Steps have no error control."
    )


def _formula(method: Method) -> str:
    """The formula of one step."""
    match method:
        case BackwardEuler():
            return f"    x+ = x + h f(x+, u)    by {method.iterations} Newton iterations from x"
        case Radau():
            return (
                "    X_i = x + h (a_i1 f(X_1, u) + a_i2 f(X_2, u) + a_i3 f(X_3, u)),   x+ = X_3\n"
                f"    by {method.iterations} simplified Newton iterations"
            )
        case Rosenbrock():
            return (
                "    [I / (gamma h) - df/dx] k_i = f(x + sum a_ij k_j, u) + sum c_ij k_j / h\n"
                f"    x+ = x + sum m_i k_i,   i = 1 ... {method.stages}, gamma = {method.gamma:.6g}"
            )
        case Exponential():
            return "    x_i+ = x_i + h phi1(h df_i/dx_i) f_i(x, u),   phi1(a) = (exp(a) - 1) / a"
        case _:
            return (
                "    X_i = x + h sum a_ij f(X_j, u),   x+ = x + h sum b_i f(X_i, u)    (explicit)"
            )
