"""Instructions and memory of a controller in C on a Cortex-M core, in a loop with disturbances."""

from collections.abc import Sequence
from pathlib import Path
from shutil import copy
from tempfile import TemporaryDirectory

import numpy as np

from ocp.mpc.controller import GeneratedController, disturbed
from ocp.mpc.session import Session
from symfric.embedded import CORES, Absent, BlockMeasurement, Tools, find_tools
from symfric.embedded.measure import counted
from symfric.embedded.target import Target
from symfric.emitter.c99 import REALS
from symfric.foundation import checks

SHIFT, LONGEST = 0, 2**24 * 40
"""Binary logarithm of the time of an instruction under QEMU [ns], and the number of instructions
after which SysTick, with a tick every 40 ns, starts again."""
PATIENCE = 60.0
PER_CYCLE = 1.0
"""Time limit of a run, and for each cycle in addition [s]."""


def measure_controller(
    made: GeneratedController,
    core: str = "m4f",
    *,
    cycles: int = 200,
    scale: float = 0.1,
    flags: Sequence[str] = ("-O2",),
    tools: Tools | Absent | None = None,
) -> BlockMeasurement:
    """Cross-compile a controller, run it under QEMU, and count the instructions of each cycle.

    The cycles are those of a loop on the host with noise, references that jump and distant states
    (`ocp.mpc.controller.disturbed`), without invalid measurements. QEMU counts instructions, not
    clock cycles, in steps of 40 instructions.

    Args:
        made: result of `Controller.to_c`.
        core: one of `symfric.embedded.CORES`: "m0plus", "m3", "m4f", "m7".
        cycles: number of cycles.
        scale: size of the disturbances: references jump by about `scale`, in their units, every 25
            cycles, and the state to about ten times `scale` nominal states every 100 cycles.
        flags: flags of the compiler.
        tools: result of `symfric.embedded.find_tools`.

    Returns:
        The measurement: `average` and `maximum` instructions of a cycle; `data`, the memory of plan
        and work space; `error`, the largest difference of a control from the host relative to its
        largest value, which may be large after cycles that do not converge. Its `status` names
        absent tools.

    Raises:
        ValueError: an unknown core, or less than one cycle.
        CompileError: the compiler rejects the code, or the program fails under QEMU.
    """
    where = "measure_controller"
    checks.kind(where, made, GeneratedController, "what to_c(...) returned")
    checks.choice(f"{where}: core", core, CORES)
    checks.number(f"{where}: scale", scale, above=0.0)
    checks.count(f"{where}: cycles", cycles, least=1, most=20_000)
    found, name = find_tools() if tools is None else tools, made.design.name
    if isinstance(found, Absent):
        return BlockMeasurement(name, made.real, core, status=f"skipped: {found.advice}")
    session, rows, expected = Session(made.design, real=REALS[made.real]), [], []
    for measured, data, action in disturbed(session, cycles, scale=scale, broken=False):
        rows.append(session.given(measured, data, made.design.settings.tolerance))
        expected.append([*action.controls.values()])
    inputs, controls = np.array(rows), np.array(expected)
    with TemporaryDirectory(prefix="symfric-") as folder:
        header, source = (Path(copy(file, folder)) for file in made.files)
        target = Target(CORES[core], found, flags)
        words, instructions = counted(
            target, Path(folder), source, _parts(made, header.name, inputs.shape[1]), made.real,
            inputs, controls.shape[1], shift=SHIFT, limit=PATIENCE + PER_CYCLE * cycles,
        )  # fmt: skip
    if instructions.max() > LONGEST / 2:  # the timer may have started again
        status = f"not measured: cycles of more than {LONGEST / 2e6:.0f} million instructions"
        return BlockMeasurement(name, made.real, core, status=status)
    results = words["rows"].view(REALS[made.real].kind).reshape(controls.shape).astype(float)
    return BlockMeasurement(
        name, made.real, core,
        average=float(instructions.mean()),
        maximum=float(round(instructions.max())),
        error=float((np.abs(results - controls).max(0) / np.abs(controls).max(0)).max()),
        finite=bool(np.isfinite(results).all()),
        text=int(words["text"][0]), library=int(words["library"][0]),
        data=int(words["data"][0]), stack=int(words["stack"][0]),
    )  # fmt: skip


def _parts(made: GeneratedController, header: str, width: int) -> dict[str, str]:
    """Return the placeholders of `sources/measured.c` for a cycle.

    A row of inputs contains the members of the struct of parameters except `iterations`, then those
    of the inputs.
    """
    design, name = made.design, made.design.name
    count = design.p0.size + design.bounds.size + 1
    controls = " ".join(f"Y[k][{i}] = out.{c.name};" for i, c in enumerate(design.controls))
    return {
        "include": f'#include "{header}"',
        "declarations": f"static {name}_t self;\nstatic {name}_param_t param;\n"
        f"static {name}_out_t out;",
        "start": f"{name}_init(&self); param = {name}_default;",
        "step": f"memcpy(&param, U[k], {count} * sizeof U[k][0]); {name}_step(&self, &param, "
        f"(const {name}_in_t *)(const void *)(U[k] + {count}), &out);",
        "keep": controls,
        "data": "sizeof self",
    }
