"""Whether algebraic equations can determine their unknowns at all: index 1, seen in the pattern."""

import casadi as ca

from symfric.foundation.checks import listed


def check_index(where: str, y: ca.SX, f: ca.SX, mass: ca.SX, names: list[str]) -> None:
    """Refuse M y' = f(y) whose equations without rates leave unknowns undetermined.

    Rates determine what M sees of y; the rest has to follow from the equations without rates.
    Constraints on positions alone, for example, do not say what their multipliers are (index 3).

    Raises:
        ValueError: structurally so, whatever the numbers.
    """
    pattern = ca.DM(mass.sparsity(), 1)
    still = [i for i in range(f.numel()) if not pattern[i, :].nnz()]
    if not still:
        return
    pattern[still, :] = ca.DM(ca.jacobian_sparsity(f[still], y), 1)
    pattern = ca.sparsify(pattern)
    rank = ca.sprank(pattern)
    if rank == f.numel():
        return
    every = range(f.numel())
    loose = [names[i] for i in every if ca.sprank(pattern[:, [k for k in every if k != i]]) == rank]
    raise ValueError(
        f"{where}: expected algebraic equations that determine {listed(loose)} at given states "
        "(index 1), got some that do not depend on them; differentiate these by time, or make what "
        "changes (a charge, a momentum) a state of its own"
    )
