"""Functions of large blocks as machine code, once that is predicted to pay.

The equations of a robot are thousands of operations at every point, which compiled code runs ten
times as fast as CasADi's virtual machine; a compiler needs as long as a few solves. It runs beside
the solver, and its result is kept in the user's cache. Both give the same bits.
"""

from dataclasses import dataclass, replace
from functools import cached_property
from typing import final

import casadi as ca

from ocp.transcription.blocks import Block
from symfric.foundation.compiler import CompileError
from symfric.integrator.compiled.background import Prospect
from symfric.integrator.compiled.compiler import library

PER_INSTRUCTION = 3e-9
"""Seconds that the virtual machine needs."""
ITERATIONS = 30
"""Of a solver, at least; it asks for every function once in each."""
FUNCTIONS = ("rows", "share", "slopes", "jacobian", "hessian")


@final
@dataclass(eq=False)
class Engine:
    """The fastest Functions of a block that are there; mutable only in what it remembers.

    Attributes:
        block: as it was made, of SX.
        expected: time [s] that compiled code would have saved so far, as predicted.
    """

    block: Block
    expected: float = 0.0

    @cached_property
    def _functions(self) -> dict[str, ca.Function]:
        found = {name: getattr(self.block, name) for name in FUNCTIONS}
        return {name: function for name, function in found.items() if function is not None}

    @cached_property
    def _instructions(self) -> int:
        if not self.block.rows.is_a("SXFunction"):
            return 0  # calls of other functions, which nobody writes as one C file
        return sum(function.n_instructions() for function in self._functions.values())

    @cached_property
    def _prospect(self) -> Prospect:
        names = tuple(function.name() for function in self._functions.values())
        return Prospect(self._source, names, self._instructions)

    @cached_property
    def _compiled(self) -> Block:
        prospect = self._prospect
        path = str(library(prospect.written(), *prospect.names))
        functions = {name: ca.external(f.name(), path) for name, f in self._functions.items()}
        return replace(self.block, **functions)

    def _source(self) -> str:
        code = ca.CodeGenerator("block.c")
        for function in self._functions.values():
            code.add(function)
        return code.dump()

    def at(self, places: int) -> Block:
        """The block, to be evaluated at so many places in every iteration of a solver."""
        if "_compiled" in self.__dict__:
            return self._compiled
        self.expected += ITERATIONS * places * self._instructions * PER_INSTRUCTION
        if self._prospect.pays(self.expected):
            try:
                return self._compiled
            except CompileError:  # a broken compiler is no reason not to solve
                self._prospect.hopeless = True
        return self.block
