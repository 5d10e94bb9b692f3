"""Closed loop of a drive with friction, its position controller and compiled compensators."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import Any, final

import casadi as ca
import numpy as np

from symfric.codegen import Block
from symfric.compensation.members import Members
from symfric.compensation.result import WITHOUT, Comparison, Loop, Reference
from symfric.emitter.c99 import REALS
from symfric.foundation import checks
from symfric.foundation.numeric import Array
from symfric.foundation.parameters import Parametric, Variable, param
from symfric.foundation.programs import Compiler, find_compiler, needed_compiler
from symfric.foundation.status import SolveError
from symfric.integrator import stepper
from symfric.integrator.plant import Plant
from symfric.laws.base import smooth
from symfric.model import Model, Output, check_model


@final
@dataclass(frozen=True, eq=False)
class Cascade(Parametric):
    """Cascade controller of position (P) and velocity (PI) with an encoder and fixed sample time.

        x_m = count round(x / count)                     position of the encoder
        v_m = v_m + share [(x_m - x_m before) / h - v_m]    filtered difference
        v_s = v_ref + kp (r - x_m)                       set velocity
        u   = kv (v_s - v_m) + I + inertia a_ref,   I+ = I + ki kv h (v_s - v_m)

    I and u are held within +-limit. The integration stops while u is at its limit, and on `hold`.
    """

    h: float = param(1e-3, unit="s", role="time", doc="sample time", lower=1e-9)
    kp: float = param(60.0, unit="1/s", doc="position gain", lower=0.0)
    kv: float = param(200.0, unit="N s/m", doc="velocity gain", lower=0.0)
    ki: float = param(20.0, unit="1/s", doc="integral gain of the velocity loop", lower=0.0)
    inertia: float = param(1.0, unit="kg", doc="mass, multiplied by a_ref", lower=0.0)
    limit: float = param(100.0, unit="N", doc="largest force", lower=0.0)
    count: float = param(1e-6, unit="m", doc="count of the encoder", lower=1e-15)
    share: float = param(
        0.5, unit="1", doc="weight of a new difference in the velocity", lower=1e-6, upper=1.0
    )

    def block(self) -> Block:
        """Return the block (x, r, v_ref, a_ref, hold) -> u and the signals x_m, v_m, e, v_s."""
        inputs = (
            Variable("x", "m", nominal=0.1, doc="position"),
            Variable("r", "m", nominal=0.1, doc="reference position"),
            Variable("v_ref", "m/s", nominal=0.1, doc="reference velocity"),
            Variable("a_ref", "m/s^2", doc="reference acceleration"),
            Variable("hold", "1", lower=0.0, upper=1.0, doc="above 0.5: no integration"),
        )
        states = (
            Variable("before", "m", doc="previous position"),
            Variable("v_before", "m/s", doc="previous velocity"),
            Variable("integral", "N", doc="integral force"),
        )
        x, r, v_ref, a_ref, hold = (v.symbol for v in inputs)
        before, v_before, integral = (v.symbol for v in states)
        x_m = self.count * ca.floor(x / self.count + 0.5)
        v_m = v_before + self.share * ((x_m - before) / self.h - v_before)
        e = r - x_m
        v_s = v_ref + self.kp * e
        wanted = self.kv * (v_s - v_m) + integral + self.inertia * a_ref
        u = smooth.clip(wanted, -self.limit, self.limit)
        more = integral + self.ki * self.kv * self.h * (v_s - v_m)
        more = smooth.clip(more, -self.limit, self.limit)
        free = ca.logic_or(wanted == u, (v_s - v_m) * u < 0)
        free = ca.logic_and(free, hold <= 0.5)
        return Block(
            "cascade",
            doc="Position controller: P in position, PI in velocity.",
            states=states,
            inputs=inputs,
            next=ca.vertcat(x_m, v_m, ca.if_else(free, more, integral)),
            outputs={
                "u": Output(u, "N", "commanded force"),
                "x_m": Output(x_m, "m", "measured position"),
                "v_m": Output(v_m, "m/s", "measured velocity"),
                "e": Output(e, "m", "position error"),
                "v_s": Output(v_s, "m/s", "set velocity"),
            },
        )


KNOWN = ("v_ref", "a_ref", "v", "e", "u", "N", "enable", "force", "learn")
"""Signals of the loop that can be inputs of a block."""
ACTING = ("F", "current")
"""Outputs of blocks that act on the plant."""
Values = Mapping[str, float | Array]
"""Parameters by name: numbers, or arrays with one value for each sample."""
WHERE = "close_loop"


def close_loop(
    plant: Model,
    reference: Reference,
    blocks: Block | Sequence[Block],
    *,
    controller: Cascade | None = None,
    estimator: Block | None = None,
    cases: Mapping[str, Values] | None = None,
    delay: int = 1,
    noise: float = 0.0,
    seed: int = 0,
    real: str = "double",
    backend: str = "auto",
    x0: Mapping[str, float] | None = None,
    p: Values | None = None,
    position: str = "x",
    velocity: str = "v",
    load: float = 1.0,
) -> Comparison:
    """Simulate a plant in a position loop, without compensation and with it in all `cases`.

    At each sample, the encoder counts the position, and the controller and the blocks are called.
    The sum of their forces, held within the limit of the controller, acts on the plant `delay`
    samples later for one sample. The plant makes the adaptive steps of `simulate`. The blocks run
    as the compiled C of `generate`, or, without a compiler, in CasADi's VM, which gives the same
    bits in double.

    Args:
        plant: a model with one input, the force; or the current of a drive (`symfric.driven`), with
            the numbers of controller, limit and blocks in amperes.
        reference: reference motion with the sample time of the controller.
        blocks: compensators and observers, whose outputs `F` or `current` are added. An output
            `hold` stops the integrator of the controller.
        controller: controller; default `Cascade()`.
        estimator: block that is called first, such as a `recursive_estimator`. Its outputs are
            written to the parameters of `blocks` with the same names, and recorded in
            `Loop.estimates`.
        cases: name -> parameters of the blocks that differ from the defaults, numbers or one value
            for each sample; default one case, "compensated".
        delay: number of samples from a command to its force.
        noise: standard deviation [m] of the position before the encoder.
        seed: seed of the noise.
        real: "double" or "float", the type of the C of the blocks.
        backend: "c", "vm" or "auto", which selects C if there is a compiler.
        x0, p: start values and parameters of the plant, by name; a parameter may have one value
            for each sample.
        position, velocity: measured states of the plant.
        load: normal force [N] for blocks with an input N.

    Returns:
        All loops. If the simulation fails or is interrupted (Ctrl-C), they end early, see
        `Loop.ended`.

    Raises:
        ValueError: bad input; different sample times of reference, controller and blocks; a block
            with an input that the loop does not have, or without F.
        CompileError: C is requested and there is no working compiler.
    """
    check_model(WHERE, plant)
    several = isinstance(blocks, Block)
    given = (blocks,) if several else checks.many(f"{WHERE}: blocks", blocks, "blocks")
    controller = Cascade() if controller is None else controller
    checks.kind(f"{WHERE}: controller", controller, Cascade, "a controller, Cascade()")
    checks.kind(f"{WHERE}: reference", reference, Reference, "a reference, such as sine(...)")
    _check(plant, given, reference, controller, position, velocity)
    if estimator is not None:
        _check_estimator(estimator, given, controller)
    held, varied = _split(p or {}, reference.x.size)
    unit = plant.signals[plant.u[0].name]
    plant = _driven(plant, varied)
    checks.count(f"{WHERE}: delay", delay, least=0)
    checks.number(f"{WHERE}: noise", noise, unit="m", lower=0.0)
    checks.check_names(f"{WHERE}: real", [real], REALS)
    checks.choice(f"{WHERE}: backend", backend, ("auto", "c", "vm"))
    compiler = None if backend == "vm" else find_compiler()
    if backend == "c":
        compiler = needed_compiler()
    wanted = {"compensated": {}} if cases is None else checks.named(f"{WHERE}: cases", cases)
    run = partial(
        _run, reference=reference, controller=controller, delay=delay, noise=noise, seed=seed,
        real=real, compiler=compiler, measured=(position, velocity), load=load,
        varied=np.column_stack([np.zeros((reference.x.size, 0)), *varied.values()]),
    )  # fmt: skip

    def going(count: int) -> Plant:
        start, own = ({n: np.full(count, v) for n, v in (of or {}).items()} for of in (x0, held))
        return stepper(plant, controller.h, batch=count, x0=start or None, p=own or None)

    known = sorted({v.name for block in given for v in block.parameters})
    if estimator is not None:
        known = sorted({*known, *(v.name for v in estimator.parameters)})
    cases = {n: checks.named(f"{WHERE}: case '{n}'", case, known) for n, case in wanted.items()}
    for case in cases.values():
        _split(case, reference.x.size)
    runs = run(going(1), (), {WITHOUT: {}})
    if cases:
        runs |= run(
            going(len(cases)), given, cases, estimators=() if estimator is None else (estimator,)
        )
    engine = "CasADi's VM" if compiler is None else f"C in {real}, {compiler}"
    units = plant.signals[position], unit
    return Comparison(plant.name, reference, runs, controller.count, engine, units)


def _split(values: Values, steps: int) -> tuple[dict[str, float], dict[str, Array]]:
    """Return the parameters that are numbers, and those with one value for each sample."""
    arrays = {n: checks.array(f"{WHERE}: {n}", x) for n, x in values.items() if np.ndim(x)}
    for name, row in arrays.items():
        if row.size != steps:
            raise checks.refused(f"{WHERE}: {name}", f"a number or {steps} values", row)
    return {n: float(x) for n, x in values.items() if n not in arrays}, arrays


def _driven(plant: Model, varied: Mapping[str, Array]) -> Model:
    """Return the plant with the parameters `varied` as further inputs."""
    checks.check_names(f"{WHERE}: p", varied, [v.name for v in plant.p])
    if not varied:
        return plant
    own = {v.name: v for v in plant.p}
    u = (*plant.u, *(own[name] for name in varied))
    return replace(plant, u=u, p=tuple(v for v in plant.p if v.name not in varied))


def _check_estimator(estimator: Block, blocks: Sequence[Block], controller: Cascade) -> None:
    where = f"{WHERE}: estimator"
    checks.kind(where, estimator, Block, "a block, such as recursive_estimator(...)")
    names = {v.name for block in blocks for v in block.parameters}
    if not names & {*estimator.outputs}:
        found = ", ".join(estimator.outputs)
        raise ValueError(f"{where}: expected outputs that are parameters of blocks, got {found}")
    _check_block(estimator, controller)


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
        at = f"{WHERE}: block '{block.name}'"
        output = next((o for n, o in block.outputs.items() if n in ACTING), None)
        if output is None:
            raise ValueError(f"{at}: expected an output {' or '.join(ACTING)}, got none")
        if (output.unit == "A") != (plant.u[0].unit == "A"):
            hint = "driven(model, drive) and compensator(..., drive=drive) are in amperes"
            wanted = f"an output in the unit of the plant's input [{plant.u[0].unit}]"
            raise ValueError(f"{at}: expected {wanted}, got {output.unit}; {hint}")
        _check_block(block, controller)


def _check_block(block: Block, controller: Cascade) -> None:
    names = [v.name for v in block.inputs]
    checks.check_names(f"{WHERE}: inputs of '{block.name}'", names, KNOWN)
    starts = {v.name: float(v.start) for v in block.parameters} | dict(block.constants)
    if "h" in starts and starts["h"] != controller.h:
        raise ValueError(
            f"{WHERE}: block '{block.name}': expected the sample time of the controller, "
            f"{controller.h:g} s, got {starts['h']:g} s; give h = {controller.h:g}"
        )


def _run(
    plant: Plant,
    blocks: Sequence[Block],
    cases: Mapping[str, Values],
    *,
    reference: Reference,
    controller: Cascade,
    delay: int,
    noise: float,
    seed: int,
    real: str,
    compiler: Compiler | None,
    measured: tuple[str, str],
    load: float,
    varied: Array,
    estimators: Sequence[Block] = (),
) -> dict[str, Loop]:
    """Return the loops of all cases for one set of blocks, simulated together."""
    count, steps = len(cases), reference.x.size
    control = Members(controller.block(), [{}] * count, compiler=compiler)
    added = [Members(block, [*cases.values()], real, compiler) for block in blocks]
    learners = [Members(b, [*cases.values()], real, compiler) for b in estimators]
    names = [name for block in estimators for name in block.outputs]
    learnt = np.zeros((steps, len(names), count))
    random = np.random.default_rng(seed)
    places = [[v.name for v in plant.model.x].index(name) for name in measured]
    rows = np.zeros((4, steps + 1, count))  # position, velocity, acting and added force
    rows[:2, 0] = plant.x[:, places].T
    control.state[:, 0] = rows[0, 0]
    forces = np.zeros((steps + 1 + delay, len(added), count))  # by sample of action
    queue = [np.zeros(count) for _ in range(delay)]
    ended, k = "", 0
    try:
        for k in range(steps):
            now = {
                "x": rows[0, k] + noise * random.standard_normal(),
                "r": reference.x[k], "v_ref": reference.v[k], "a_ref": reference.a[k],
                "u": rows[2, k - 1], "force": rows[2, k - 1], "N": load, "enable": 1.0,
                "learn": 1.0,
            }  # fmt: skip
            command = _commanded(control, added, learners, k, now, forces[k], forces[k + 1 + delay])
            for learner in learners:
                learnt[k] = learner.output.T
            rows[3, k] = forces[k + 1 + delay].sum(axis=0)
            queue.append(np.clip(command, -controller.limit, controller.limit))
            rows[2, k] = queue.pop(0)
            acting = np.column_stack([rows[2, k], np.tile(varied[k], (count, 1))])
            rows[:2, k + 1] = plant.step(acting)[:, places].T
        k = steps
    except KeyboardInterrupt:
        ended = f"interrupted at {k * controller.h:g} s"
    except SolveError as error:
        ended = f"stopped at {k * controller.h:g} s: {error}"
    status = np.bitwise_or.reduce(
        [np.zeros(count, np.uint32), *(b.status for b in (*added, *learners))]
    )
    return {
        name: Loop(name, reference, *(rows[i, : k + (i < 2), m] for i in range(4)),
                   limit=controller.limit, ended=ended, status=int(status[m]),
                   estimates={n: learnt[:k, i, m] for i, n in enumerate(names)})
        for m, name in enumerate(cases)
    }  # fmt: skip


def _commanded(
    control: Members,
    added: Sequence[Members],
    learners: Sequence[Members],
    k: int,
    now: Mapping[str, float | Array],
    acted: Array,
    forces: Array,
) -> Array:
    """Return the total command at sample k; write the `forces` of the blocks.

    The input u of an observer excludes the forces `acted` of other blocks over the last interval.
    """
    for name in ("x", "r", "v_ref", "a_ref"):
        control.inputs[name][:] = now[name]
    control.step()
    seen = {**now, "v": control.outputs["v_m"], "e": control.outputs["e"]}
    for learner in learners:
        learner.change(k)
        for name, place in learner.inputs.items():
            place[:] = seen[name]
        learner.step()
    for i, block in enumerate(added):
        block.change(k)
        for learner in learners:
            for name in block.params.keys() & learner.outputs.keys():
                block.params[name][:] = learner.outputs[name]
        for name, place in block.inputs.items():
            place[:] = seen[name]
            if name == "u":
                place -= acted.sum(axis=0) - acted[i]
        block.step()
        forces[i] = next(block.outputs[name] for name in ACTING if name in block.outputs)
        if "hold" in block.outputs:
            control.inputs["hold"][:] = block.outputs["hold"]
    return control.outputs["u"] + forces.sum(axis=0)
