"""Drive with friction under its position controller, with the generated C of a compensator."""

import ctypes
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, final

import numpy as np
from numpy.typing import NDArray

from symfric.codegen import Block, generate
from symfric.codegen.layout import TEMPLATES, CBlock, filled
from symfric.codegen.runner import FLAGS
from symfric.compensation.compensator import Cascade
from symfric.compensation.result import WITHOUT, Comparison, Loop, Reference
from symfric.emitter.c99 import REALS
from symfric.foundation import checks
from symfric.foundation.files import write_text
from symfric.foundation.numeric import bound
from symfric.foundation.programs import CompileError, Compiler, find_compiler, no_compiler
from symfric.foundation.status import SolveError
from symfric.integrator import stepper
from symfric.integrator.plant import Plant
from symfric.model import Model, check_model

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
        """Return `values` has the parameters of each member that are not the default.

        Raises:
            ValueError: unknown parameters.
            CompileError: the compiler refuses the C, or what it made does not load here.
        """
        self.block, count = block, len(values)
        kind = REALS[real].kind
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


KNOWN = ("v_ref", "a_ref", "v", "e", "u", "N", "enable")
"""Signals of the loop that a block may take."""
WHERE = "close_loop"


@final
@dataclass(frozen=True, eq=False)
class Setup:
    """Settings that all runs of a comparison share; see `close_loop`."""

    controller: Cascade
    delay: int
    noise: float
    seed: int
    real: str
    compiler: Compiler | None
    measured: tuple[str, str]
    load: float


def close_loop(
    plant: Model,
    reference: Reference,
    blocks: Block | Sequence[Block],
    *,
    controller: Cascade | None = None,
    cases: Mapping[str, Mapping[str, float]] | None = None,
    delay: int = 1,
    noise: float = 0.0,
    seed: int = 0,
    real: str = "double",
    backend: str = "auto",
    x0: Mapping[str, float] | None = None,
    p: Mapping[str, float] | None = None,
    position: str = "x",
    velocity: str = "v",
    load: float = 1.0,
) -> Comparison:
    """Let a plant follow a reference, without compensation and with it in all `cases`.

    At each sample the encoder counts the position, the controller and the blocks are called, and
    their forces added, held within the limit of the controller, act on the plant from `delay`
    samples later for one sample. The plant goes on by the adaptive steps of `simulate`. What is
    called is the C that `generate` writes, compiled here; without a compiler CasADi's VM, which
    gives the same bits in double.

    Args:
        plant: with one input, the force; any law, bristles, events.
        reference: with the sample time of the controller.
        blocks: compensators and observers; their outputs `F` are added. An output `hold` stops the
            integrator of the controller.
        controller: default `Cascade()`.
        cases: name -> parameters of the blocks that are not their default; default one case,
            "compensated". The parameters of all blocks are looked for.
        delay: samples from a command to its force.
        noise: standard deviation [m] of the position before it is counted.
        seed: of the noise.
        real: "double" or "float", the type of the C of the blocks.
        backend: "c", "vm", or "auto", C where there is a compiler.
        x0, p: start values and parameters of the plant by name.
        position, velocity: states of the plant that are measured and shown.
        load: normal force [N] for blocks with an input N.

    Returns:
        All loops. A plant that cannot be simulated further, or Ctrl-C, ends them early; `ended`
        says so.

    Raises:
        ValueError: bad input; another sample time in the controller or a block; a block with an
            input that the loop does not have, or without F.
        CompileError: C was requested, and there is no compiler or it failed.
    """
    check_model(WHERE, plant)
    given = (
        (blocks,)
        if isinstance(blocks, Block)
        else checks.many(f"{WHERE}: blocks", blocks, "blocks")
    )
    controller = Cascade() if controller is None else controller
    checks.kind(f"{WHERE}: controller", controller, Cascade, "a controller, Cascade()")
    checks.kind(f"{WHERE}: reference", reference, Reference, "a reference, such as sine(...)")
    _check(plant, given, reference, controller, position, velocity)
    checks.count(f"{WHERE}: delay", delay, least=0)
    checks.number(f"{WHERE}: noise", noise, unit="m", lower=0.0)
    checks.check_names(f"{WHERE}: real", [real], REALS)
    checks.choice(f"{WHERE}: backend", backend, ("auto", "c", "vm"))
    compiler = None if backend == "vm" else find_compiler()
    if backend == "c" and compiler is None:
        raise no_compiler()
    wanted = {"compensated": {}} if cases is None else checks.named(f"{WHERE}: cases", cases)
    setup = Setup(
        controller=controller,
        delay=delay,
        noise=noise,
        seed=seed,
        real=real,
        compiler=compiler,
        measured=(position, velocity),
        load=load,
    )

    def going(count: int) -> Plant:
        start, own = ({n: np.full(count, v) for n, v in (of or {}).items()} for of in (x0, p))
        return stepper(plant, controller.h, batch=count, x0=start or None, p=own or None)

    values = [_own(given, name, case) for name, case in wanted.items()]
    runs = _run(going(1), reference, (), [[]], (WITHOUT,), setup)
    if wanted:
        runs |= _run(going(len(values)), reference, given, values, tuple(wanted), setup)
    engine = "CasADi's VM" if compiler is None else f"C in {real}, {compiler}"
    units = plant.signals[position], plant.signals[plant.u[0].name]
    return Comparison(plant.name, reference, runs, controller.count, engine, units)


def _check(
    plant: Model, blocks: Sequence[Any], reference: Reference, controller: Cascade,
    position: str, velocity: str,
) -> None:  # fmt: skip
    hint = "name what is measured: position='...', velocity='...'"
    checks.check_names(f"{WHERE}: plant", [position, velocity], [v.name for v in plant.x], hint)
    if len(plant.u) != 1:
        names = ", ".join(v.name for v in plant.u) or "none"
        raise ValueError(f"{WHERE}: plant: expected one input, the force, got {names}")
    if reference.h != controller.h:
        raise ValueError(
            f"{WHERE}: reference: expected the sample time of the controller, {controller.h:g} s, "
            f"got {reference.h:g} s"
        )
    for block in blocks:
        checks.kind(f"{WHERE}: blocks", block, Block, "a block, such as compensator(LuGre())")
        names = [v.name for v in block.inputs]
        checks.check_names(f"{WHERE}: inputs of '{block.name}'", names, KNOWN)
        if "F" not in block.outputs:
            raise ValueError(f"{WHERE}: block '{block.name}': expected an output F, got none")
        starts = {v.name: float(v.start) for v in block.parameters} | dict(block.constants)
        if "h" in starts and starts["h"] != controller.h:
            raise ValueError(
                f"{WHERE}: block '{block.name}': expected the sample time of the controller, "
                f"{controller.h:g} s, got {starts['h']:g} s; give h = {controller.h:g}"
            )


def _own(blocks: Sequence[Block], name: str, case: Mapping[str, float]) -> list[dict[str, float]]:
    """Return the parameters of a case for each block."""
    where = f"{WHERE}: case '{name}'"
    known = [{v.name for v in block.parameters} for block in blocks]
    found = checks.named(where, case, sorted(set().union(*known)))
    return [{n: v for n, v in found.items() if n in names} for names in known]


def _run(
    plant: Plant,
    reference: Reference,
    blocks: Sequence[Block],
    values: Sequence[Sequence[Mapping[str, float]]],
    names: Sequence[str],
    setup: Setup,
) -> dict[str, Loop]:
    """Members of one set of blocks, side by side."""
    controller, compiler = setup.controller, setup.compiler
    count, steps = len(names), reference.x.size
    control = Members(controller.block(), [{}] * count, compiler=compiler)
    added = [
        Members(block, [own[i] for own in values], setup.real, compiler)
        for i, block in enumerate(blocks)
    ]
    random = np.random.default_rng(setup.seed)
    places = [[v.name for v in plant.model.x].index(name) for name in setup.measured]
    rows = np.zeros((4, steps + 1, count))  # position, velocity, acting and added force
    rows[:2, 0] = plant.x[:, places].T
    control.state[:, 0] = rows[0, 0]
    forces = np.zeros((steps + 1 + setup.delay, len(added), count))  # of each block, when it acts
    queue = [np.zeros(count) for _ in range(setup.delay)]
    ended, k = "", 0
    try:
        for k in range(steps):
            now = {
                "x": rows[0, k] + setup.noise * random.standard_normal(),
                "r": reference.x[k], "v_ref": reference.v[k], "a_ref": reference.a[k],
                "u": rows[2, k - 1], "N": setup.load, "enable": 1.0,
            }  # fmt: skip
            command = _commanded(control, added, now, forces[k], forces[k + 1 + setup.delay], setup)
            rows[3, k] = forces[k + 1 + setup.delay].sum(axis=0)
            queue.append(command)
            rows[2, k] = queue.pop(0)
            rows[:2, k + 1] = plant.step(rows[2, k][:, None])[:, places].T
        k = steps
    except KeyboardInterrupt:
        ended = f"interrupted at {k * controller.h:g} s"
    except SolveError as error:
        ended = f"stopped at {k * controller.h:g} s: {error}"
    status = np.bitwise_or.reduce([np.zeros(count, np.uint32), *(b.status for b in added)])
    return {
        name: Loop(name, reference, *(rows[i, : k + (i < 2), m] for i in range(4)),
                   limit=controller.limit, ended=ended, status=int(status[m]))
        for m, name in enumerate(names)
    }  # fmt: skip


def _commanded(
    control: Members,
    added: Sequence[Members],
    now: Mapping[str, float | Array],
    acted: Array,
    forces: Array,
    setup: Setup,
) -> Array:
    """Return the command of controller and blocks together; the `forces` of the blocks are written.

    `acted` are those over the last interval: an observer of forces does not see what others do.
    """
    for name in ("x", "r", "v_ref", "a_ref"):
        control.inputs[name][:] = now[name]
    control.step()
    seen = {**now, "v": control.outputs["v_m"], "e": control.outputs["e"]}
    for i, block in enumerate(added):
        for name, place in block.inputs.items():
            place[:] = seen[name]
            if name == "u":
                place -= acted.sum(axis=0) - acted[i]
        block.step()
        forces[i] = block.outputs["F"]
        if "hold" in block.outputs:
            control.inputs["hold"][:] = block.outputs["hold"]
    most = setup.controller.limit
    return np.clip(control.outputs["u"] + forces.sum(axis=0), -most, most)
