"""An attempt in the form that suits its size: operation by operation, or calls of blocks."""

import casadi as ca

from symfric.integrator.equations.blocks import blocks
from symfric.integrator.equations.system import System
from symfric.integrator.methods.method import Method
from symfric.integrator.step.attempt import build_step
from symfric.integrator.step.tangent import tangent


def written(system: System, method: Method, inline: int) -> tuple[ca.Function, int]:
    """The attempt, written out unless that takes more than `inline` instructions; how many it has.

    What is large for sure is not written out to be counted: that took half the time of building a
    long chain.
    """
    if least(system, method) <= inline:
        step = build_step(system, method)
        count = step.n_instructions()
        if count <= inline:
            return step, count
    step = build_step(system, method, ca.MX)
    return step, instructions(step)


def least(system: System, method: Method) -> int:
    """Instructions of an attempt's blocks, without what joins them; 0 without blocks."""
    gamma, chart = method.diagonal, tangent(system)
    if gamma is None:
        return 0
    block = blocks(system if chart is None else chart.reduced, gamma)
    stages, jacobians, factorisations = method.work(system)
    every = stages * (block.f.n_instructions() + block.solve.n_instructions())
    once = jacobians * block.slopes.n_instructions()
    return every + once + factorisations * block.pack.n_instructions()


def instructions(step: ca.Function) -> int:
    """Operations on numbers in a step that calls blocks."""
    found = 0
    for k in range(step.n_instructions()):
        operation = step.instruction_id(k)
        if operation == ca.OP_CALL:
            found += step.instruction_MX(k).which_function().n_instructions()
        elif operation not in (ca.OP_INPUT, ca.OP_OUTPUT):
            found += step.instruction_MX(k).nnz()
    return found
