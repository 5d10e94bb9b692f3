"""Instances of a block that step together, as compiled C or in CasADi's VM."""

import ctypes
from collections.abc import Mapping, Sequence
from functools import partial
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, final

import numpy as np

from symfric.codegen import Block, generate
from symfric.codegen.blocks.block import TEMPLATES, CBlock
from symfric.codegen.runner import FLAGS
from symfric.emitter.c99 import REALS, filled
from symfric.foundation import checks
from symfric.foundation.files import write_text
from symfric.foundation.numeric import Array, bound
from symfric.foundation.programs import CompileError, Compiler

COMPILED: dict[tuple[str, str, str], Any] = {}
"""Fingerprint of a block, type and compiler -> compiled function that steps all members."""


@final
class Members:
    """Instances of a block; rows of the arrays are members and may be written between steps.

    Attributes:
        block: the block.
        state, param, input, output: shapes (members, ...), in the order of the block.
        status: bits of all steps so far for each member; 0 in the VM, which has no guards.
        inputs, params, outputs: columns of the arrays, by name.
        step: function that makes one step of all members.
    """

    def __init__(
        self,
        block: Block,
        values: Sequence[Mapping[str, float | Array]],
        real: str = "double",
        compiler: Compiler | None = None,
    ) -> None:
        """Begin at the start values, with the parameters among `values` of each member.

        A parameter with an array has one value for each step, which `change` selects.

        Raises:
            ValueError: values that are not numbers.
            CompileError: the compiler rejects the C, or the library does not load.
        """
        self.block, count = block, len(values)
        kind = REALS[real].kind

        def rows(numbers: Sequence[Any]) -> Any:
            return np.tile(np.array(numbers, kind), (count, 1))

        self.state = rows([v.start for v in block.states])
        self.param = rows([v.start for v in block.parameters])
        self.input = rows([0.0] * len(block.inputs))
        self.output = rows([0.0] * len(block.outputs))
        self.status = np.zeros(count, np.uint32)
        self.inputs = {v.name: self.input[:, i] for i, v in enumerate(block.inputs)}
        self.outputs = {name: self.output[:, i] for i, name in enumerate(block.outputs)}
        self.params = {v.name: self.param[:, i] for i, v in enumerate(block.parameters)}
        self._varied = list[tuple[Array, int, Array]]()
        for member, own in enumerate(values):
            for name in own.keys() & self.params.keys():
                where = f"block '{block.name}': {name}"
                if np.ndim(own[name]):
                    self._varied.append((self.params[name], member, checks.array(where, own[name])))
                else:
                    self.params[name][member] = checks.number(where, own[name])
        self.step = self._in_c(real, compiler) if compiler else self._in_vm()

    def change(self, k: int) -> None:
        """Set the parameters that vary to their values for step k."""
        for column, member, values in self._varied:
            column[member] = values[k]

    def _in_c(self, real: str, compiler: Compiler) -> Any:
        key = (self.block.fingerprint, real, str(compiler))
        step = COMPILED.get(key) or COMPILED.setdefault(key, self._compiled(real, compiler))
        arrays = (self.state, self.param, self.input, self.output, self.status)
        given = [ctypes.c_long(len(self.state)), *(ctypes.c_void_p(a.ctypes.data) for a in arrays)]
        return partial(step, *given)

    def _compiled(self, real: str, compiler: Compiler) -> Any:
        c = CBlock(self.block, REALS[real])
        with TemporaryDirectory(prefix="symfric-") as folder:
            made = generate(self.block, folder, real=real, kit=False)
            glue, library = Path(folder) / "members.c", Path(folder) / "members.so"
            write_text(glue, filled(TEMPLATES / "members.c", **c.sizes))
            parts = [str(made.source(real)), str(glue), "-o", str(library), "-lm"]
            compiler.run(*FLAGS, "-shared", "-fPIC", *parts)
            try:
                found = ctypes.CDLL(str(library))["members"]
            except OSError as error:
                raise CompileError(f"the library does not load on this machine: {error}") from None
        found.restype = None
        return found

    def _in_vm(self) -> Any:
        # rows of the arrays are columns in CasADi
        arrays = [np.array(a, float) for a in (self.state, self.param, self.input)]
        results = [np.zeros(a.shape) for a in (self.state, self.output)]
        evaluate = bound(self.block.step.map(len(self.state)), arrays, results)

        def go() -> None:
            for own, given in zip(arrays, (self.state, self.param, self.input), strict=True):
                own[:] = given
            evaluate()
            self.state[:], self.output[:] = results

        return go
