"""Generated C of many blocks as one program: one compilation, without warnings, with sanitizer."""

from collections.abc import Collection, Sequence
from dataclasses import replace
from functools import cache
from pathlib import Path

import casadi as ca
import numpy as np

from symfric.codegen import Block, law_block
from symfric.codegen.blocks.block import CBlock
from symfric.codegen.compared import ComparedRun
from symfric.codegen.guards import Status
from symfric.codegen.runner import WARNINGS, program, run_vm
from symfric.codegen.source import header, source
from symfric.codegen.vectors import changed_value
from symfric.codegen.verification import excitation, spoiled, varied
from symfric.emitter.c99 import REALS
from symfric.foundation.numeric import bound
from symfric.foundation.programs import Compiler, finished

block_of = cache(law_block)
"""Blocks of laws with default options, made once for all tests."""


def along(
    block: Block, inputs: np.ndarray, p: np.ndarray | None = None, state: object = None
) -> tuple[np.ndarray, np.ndarray]:
    """States after each step and outputs, by CasADi, for inputs (steps, inputs).

    `p` are parameters (steps, parameters) or (parameters,), by default those of the block.
    """
    n, x = len(inputs), [float(v.start) for v in block.states] if state is None else state
    p = np.array([float(v.start) for v in block.parameters]) if p is None else p
    steps = block.step.mapaccum("steps", n, {"base": 10})
    states, outputs = steps(ca.DM(x), np.broadcast_to(p, (n, p.shape[-1])).T, inputs.T)
    return states.full().T, outputs.full().T


class Stepper:
    """Block that makes one step a call, by CasADi; inputs that are not given are 0.

    `x` are its states, which may be written between steps.
    """

    def __init__(self, block: Block, **parameters: float) -> None:
        self.block = block
        self.x = np.array([float(v.start) for v in block.states])
        self.p = np.array([parameters.get(v.name, float(v.start)) for v in block.parameters])
        self.u, self.y = np.zeros(len(block.inputs)), np.zeros(len(block.outputs))
        self.end = np.zeros_like(self.x)
        self.go = bound(block.step, (self.x, self.p, self.u), (self.end, self.y))

    def __call__(self, **inputs: float) -> dict[str, float]:
        self.u[:] = [inputs.get(v.name, 0.0) for v in self.block.inputs]
        self.go()
        self.x[:] = self.end
        return dict(zip(self.block.outputs, self.y.tolist(), strict=True))


LIMITED = ("quarter_car_general", "rate_and_state", "rate_and_state, slip")
"""Laws without a value for every argument: a stroke beyond the damper's length, exp of any age."""

STRICT = ("-std=c99", "-ffp-contract=off", *WARNINGS, "-Werror")
UNDEFINED = ("-O0", "-fsanitize=undefined", "-fno-sanitize-recover=all")

Job = tuple[int, np.ndarray] | tuple[int, np.ndarray, np.ndarray]
"""Number of a block, inputs of each step, and its parameters if they are not the defaults."""


class OneProgram:
    """Program of several blocks, named b0, b1, ... in both types."""

    def __init__(
        self, blocks: Sequence[Block], folder: Path, compiler: Compiler, *,
        real: str = "double", guards: bool = True, flags: Sequence[str] = UNDEFINED,
    ) -> None:  # fmt: skip
        self.several = [
            CBlock(replace(block, name=f"b{k}"), REALS[real], guards)
            for k, block in enumerate(blocks)
        ]
        self.executable = folder / f"all_{real}"
        parts, cases = ["#define NO_MAIN"], list[str]()
        for k, c in enumerate(self.several):
            (folder / f"{c.name}.h").write_text(header(c))
            (folder / f"{c.name}.c").write_text(source(c))
            parts += [f'#include "{c.name}.c"', program(c)]
            cases.append(f"case {k}: if (!{c.name}_run(n[1], (int)n[2])) {{ return 1; }} break;")
        loop = "long n[3]; while (fread(n, sizeof n, 1, stdin) == 1) { switch (n[0]) {"
        parts += [f"int main(void) {{ {loop}", *cases, "default: return 2; } }", "return 0; }"]
        file = self.executable.with_suffix(".c")
        file.write_text("\n".join(parts))
        compiler.run(*STRICT, *flags, str(file), "-o", str(self.executable), "-lm")

    def run(self, jobs: Sequence[Job]) -> list[np.ndarray]:
        """Rows of each job, see `run_c`."""
        data, shapes, found = b"", list[tuple[int, int]](), list[np.ndarray]()
        kind = self.several[0].real.kind
        for k, inputs, *parameters in jobs:
            given = np.column_stack([*parameters, inputs])
            with np.errstate(over="ignore", under="ignore"):
                numbers = given.astype(kind).tobytes()
            data += np.array([k, len(inputs), len(parameters)], "l").tobytes() + numbers
            shapes.append((len(inputs), len(self.several[k].signals)))
        done = finished([str(self.executable)], data)
        assert done.status == 0, done.messages[-2000:]
        numbers = np.frombuffer(done.output, kind).astype(float)
        for steps, columns in shapes:
            found.append(numbers[: steps * columns].reshape(steps, columns))
            numbers = numbers[steps * columns :]
        assert not numbers.size
        return found


STEPS = 120


def jobs_of(program: OneProgram) -> list[Job]:
    """Valid inputs, bad ones, other parameters, and every parameter changed alone."""
    jobs = []
    for k, c in enumerate(program.several):
        u = excitation(c.block, STEPS)
        start = np.array([float(v.start) for v in c.block.parameters])
        one_by_one = np.tile(start, (STEPS, 1))
        for i, v in enumerate(c.block.parameters):
            one_by_one[4 * i : 4 * i + 4, i] = changed_value(v)
        jobs += [(k, u), (k, spoiled(c.block, u)), (k, u, varied(c.block, STEPS, 10.0)),
                 (k, u, one_by_one)]  # fmt: skip
    return jobs


def has_bits(program: OneProgram, limited: frozenset[int] = frozenset()) -> None:
    """The rows and status of all jobs are those of CasADi in double; valid numbers set no bit."""
    jobs = jobs_of(program)
    for number, ((k, u, *p), rows) in enumerate(zip(jobs, program.run(jobs), strict=True)):
        c = program.several[k]
        assert np.array_equal(rows, run_vm(c, u, None, *p), equal_nan=True), (k, c.block.doc)
        status = rows[:, -1].astype(int)
        if number % 4 == 1:
            assert status.any()
            assert k in limited or not (status & Status.OUTPUT).any()
        else:
            assert not status.any()


def is_near(program: OneProgram, tolerance: float, steep: Collection[int] = ()) -> None:
    """In float, every step agrees with CasADi's from the same states; twice 1e-4 if steep."""
    jobs = [job for number, job in enumerate(jobs_of(program)) if number % 4 < 3]
    for (k, u, *p), rows in zip(jobs, program.run(jobs), strict=True):
        c, parameters = program.several[k], p[0] if p else None
        expected = run_vm(c, u, rows[:, : len(c.block.states)], parameters)
        run = ComparedRun(c, u, parameters, rows, expected)
        assert run.error <= (2e-4 if k in steep else tolerance), (k, c.block.doc, run.worst)
