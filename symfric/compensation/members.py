"""Many members of one block that go step by step together: the generated C itself, or the VM."""

import ctypes
from collections.abc import Mapping, Sequence
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, final

import numpy as np
from numpy.typing import NDArray

from symfric.codegen import Block, generate
from symfric.codegen.compiler import FLAGS
from symfric.codegen.layout import TEMPLATES, called, filled, prefix
from symfric.codegen.runner import bound
from symfric.emitter.c99 import REALS, Real
from symfric.foundation import checks
from symfric.foundation.compiler import CompileError, Compiler
from symfric.foundation.files import write_text

Array = NDArray[np.float64]

COMPILED: dict[tuple[str, str, str], Any] = {}
"""Of this process: fingerprint of a block, type and compiler -> its function of members."""


@final
class Members:
    """Blocks side by side; rows are members, and the arrays may be written between steps.

    Attributes:
        block: what they are.
        state, param, input, output: shapes (members, ...), in the order of the block.
        status: bits of all steps so far, a number each; 0 in the VM, which has no guards.
    """

    def __init__(
        self,
        block: Block,
        values: Sequence[Mapping[str, float]],
        real: str = "double",
        compiler: Compiler | None = None,
    ) -> None:
        """`values` has the parameters of each member that are not the default.

        Raises:
            ValueError: unknown parameters.
            CompileError: the compiler refuses the C, or what it made does not load here.
        """
        self.block, count = block, len(values)
        kind: Any = np.float32 if real == "float" else np.float64
        self.state = np.tile(np.array([v.start for v in block.states], kind), (count, 1))
        self.param = np.tile(np.array([v.start for v in block.parameters], kind), (count, 1))
        self.input = np.zeros((count, len(block.inputs)), kind)
        self.output = np.zeros((count, len(block.outputs)), kind)
        self.status = np.zeros(count, np.uint32)
        self.inputs = {v.name: self.input[:, i] for i, v in enumerate(block.inputs)}
        self.outputs = {name: self.output[:, i] for i, name in enumerate(block.outputs)}
        names = [v.name for v in block.parameters]
        for row, own in zip(self.param, values, strict=True):
            for name, value in checks.named(f"block '{block.name}'", own, names).items():
                row[names.index(name)] = checks.number(f"block '{block.name}': {name}", value)
        self.step = self._in_c(real, compiler) if compiler else self._in_vm()

    def _in_c(self, real: str, compiler: Compiler) -> Any:
        key = (self.block.fingerprint, real, str(compiler))
        if key not in COMPILED:
            COMPILED[key] = self._compiled(real, compiler)
        arrays = (self.state, self.param, self.input, self.output, self.status)
        given = [ctypes.c_long(len(self.state)), *(ctypes.c_void_p(a.ctypes.data) for a in arrays)]
        return lambda: COMPILED[key](*given)

    def _compiled(self, real: str, compiler: Compiler) -> Any:
        kind = REALS[real]
        name = prefix(self.block, kind)
        with TemporaryDirectory(prefix="symfric-") as folder:
            generate(self.block, folder, real=real, kit=False)
            glue, library = Path(folder) / "members.c", Path(folder) / "members.so"
            call = self._call(kind)
            write_text(glue, filled(TEMPLATES / "members.c", name=name, real=kind.name, call=call))
            sources = [str(Path(folder) / f"{name}.c"), str(glue)]
            compiler.run(*FLAGS, "-shared", "-fPIC", *sources, "-o", str(library), "-lm")
            try:
                found = ctypes.CDLL(str(library))["members"]
            except OSError as error:
                raise CompileError(f"the library does not load on this machine: {error}") from None
        found.restype = None
        return found

    def _call(self, real: Real) -> str:
        """The statements of a step of member i."""
        name = prefix(self.block, real)
        arrays = {"state": self.state, "param": self.param, "in": self.input, "out": self.output}
        sizes = {group: array.shape[1] for group, array in arrays.items()}
        pointers = {
            group: f"({'const ' * (group in ('param', 'in'))}{name}_{group}_t *)({group} + {n} * i)"
            for group, n in sizes.items()
        }
        inputs = [f"in[{sizes['in']} * i + {k}]" for k in range(sizes["in"])]
        call = called(self.block, real, True, pointers, inputs, "&status[i]")
        idle = "".join(f"(void){group}; " for group, n in sizes.items() if not n)
        return f"{idle}{'out[i] =' if self.block.is_function else 'status[i] |='} {call}"

    def _in_vm(self) -> Any:
        # CasADi's columns are the rows of the arrays
        arrays = [np.array(a, float) for a in (self.state, self.param, self.input)]
        results = [np.zeros(a.shape) for a in (self.state, self.output)]
        evaluate = bound(self.block.step.map(len(self.state)), arrays, results)

        def go() -> None:
            for own, given in zip(arrays, (self.state, self.param, self.input), strict=True):
                own[:] = given
            evaluate()
            self.state[:], self.output[:] = results

        return go
