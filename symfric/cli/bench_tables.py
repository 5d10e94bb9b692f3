"""Tables of the benchmarks."""

from collections.abc import Sequence
from typing import TYPE_CHECKING

from symfric.cli import output
from symfric.figures import FigureData

if TYPE_CHECKING:
    from symfric.bench import (
        Benchmark,
        CallBenchmark,
        CodegenBenchmark,
        EmbeddedBenchmark,
        IdentificationBenchmark,
        InteropBenchmark,
        IvpBenchmark,
        LaneBenchmark,
        MultibodyBenchmark,
        OcpBenchmark,
        RegularisationBenchmark,
    )
    from symfric.bench.cuda import CudaRow


def integrator(result: "Benchmark") -> None:
    """Runs, ratios, ensembles and derivatives."""
    output.show_table(
        ["case", "integrator", "rtol", "error", "time [ms]", "steps"],
        [
            [r.case, r.integrator, r.rtol, _short(r.error), 1e3 * r.time_s, r.steps]
            for r in result.rows
        ],
        "Time of a run of 20 s against its error",
    )
    output.show_table(
        ["case", "error", "integrator", "time [ms]", "ratio"],
        [
            [r["case"], r["error"], r["integrator"], 1e3 * r["time_s"], round(r["ratio"], 2)]
            for r in result.to_dict()["ratios"]
        ],
        "At equal error, time over that of symfric compiled",
    )
    output.show_table(
        ["case", "members", "threads", "us each", "efficiency", "cvodes"],
        [
            [r.case, r.members, r.workers, round(1e6 * r.member_s, 1), round(r.efficiency, 2),
             round(r.ratio, 1)]
            for r in result.ensemble
        ],
        "Ensembles; cvodes: time of a Python loop over cvodes at the same rtol over ours",
    )  # fmt: skip
    output.show_table(
        ["case", "integrator", "p", "run [ms]", "forward", "adjoint"],
        [
            [r.case, r.integrator, r.parameters, round(1e3 * r.plain_s, 3),
             round(r.forward, 1), "failed" if r.adjoint is None else f"{r.adjoint:.1f}"]
            for r in result.sensitivities
        ],
        "Derivatives by p parameters: time of the run with them over that of the run alone",
    )  # fmt: skip
    _skipped(result.skipped)


def calls(result: "CallBenchmark") -> None:
    """What is done by which way, and what that costs."""
    output.show_table(
        ["task", "by", "time [us]", "per", "error", "ratio"],
        [
            [r.task, r.who, _short(r.time_us), r.per, _short(r.error) if r.error == r.error else "",
             round(r.ratio, 2)]
            for r in result.rows
        ],
        "Processor time; ratio: over the first way of the task",
    )  # fmt: skip


def ensemble(result: "LaneBenchmark") -> None:
    """Members side by side and one by one."""
    output.show_table(
        ["case", "lanes", "us each", "alone", "ratio", "attempts"],
        [
            [r.case, r.lanes, round(r.member_us, 1), round(r.alone_us, 1), round(r.ratio, 2),
             round(r.attempts)]
            for r in result.rows
        ],
        "Processor time of a member on one core; ratio: alone over side by side",
    )  # fmt: skip
    output.show_table(
        ["case", "members", "again [ms]", "equal", "differ"],
        [
            [r.case, r.members, round(r.again_ms, 2), f"{r.equal:.0%}", _short(r.difference)]
            for r in result.rows
        ],
        "again: another call, one member; equal: with the same attempts; differ: at the end",
    )
    on_graphics_processor(result.cuda)


def on_graphics_processor(rows: "Sequence[CudaRow]") -> None:
    """Members a second, or that there is none."""
    output.show_table(
        ["case", "type", "a second", "on cores", "ratio", "differ"],
        [
            [r.case, r.real, r.device, "", "", ""] if r.why else
            [r.case, r.real, round(r.per_second), round(r.cores_per_second), round(r.ratio, 1),
             _short(r.difference)]
            for r in rows
        ],
        "Members a second on a graphics processor, beside all cores",
    )  # fmt: skip
    for device in dict.fromkeys(r.why or f"{r.device}, {r.members} members" for r in rows):
        output.note(device)


def multibody(result: "MultibodyBenchmark") -> None:
    """Runs, ratios, compilation, counts, chains, reference numbers, constraints and energy."""
    output.show_table(
        ["case", "integrator", "rtol", "error", "time [ms]", "steps", "gcc [s]"],
        [
            [r.case, r.integrator, r.setting, _short(r.error), _short(1e3 * r.time_s), r.steps,
             round(r.compile_s, 2)]
            for r in result.runs
        ],
        "Time of a run against its error; rtol: for Exudyn the number of steps",
    )  # fmt: skip
    for case in dict.fromkeys(r.case for r in result.runs):
        output.show_table(
            ["bound", "integrator", "rtol", "error", "steps", "time [ms]", "ratio", "to loop"],
            [
                [r.bound, r.integrator, r.setting, _short(r.error), r.steps,
                 _short(1e3 * r.time_s), round(r.ratio, 1), round(r.loop_ratio, 1)]
                for r in result.ratios()
                if r.case == case
            ],
            f"{case}: the loosest tolerance that keeps an error; ratio: over the time of "
            "`simulate` in joint coordinates, to loop: over that of its compiled loop alone",
        )  # fmt: skip
    output.show_table(
        ["mechanism", "coordinates", "build [s]", "lines of C", "gcc [s]"],
        [
            [r.mechanism, r.formulation, _short(r.build_s), r.lines, round(r.compile_s, 2)]
            for r in result.compiled
        ],
        "Our step as machine code, once for all tolerances and parameters",
    )
    _costs(result)
    _accuracy(result)
    _skipped(result.skipped)


def _costs(result: "MultibodyBenchmark") -> None:
    output.show_table(
        ["mechanism", "variant", "in", "x", "z", "ode", "step", "nonzeros"],
        [
            [r.mechanism, r.variant, r.formulation, r.states, r.algebraic, r.ode, r.step,
             r.nonzeros]
            for r in result.counts
        ],
        "What a mechanism needs: states, algebraic variables, CasADi instructions, nonzeros",
    )  # fmt: skip
    growth = ", ".join(f"{name} {value:.2f}" for name, value in result.exponents().items())
    output.show_table(
        ["links", "build [s]", "instructions", "step [us]"],
        [
            [r.links, _short(r.build_s), r.instructions, _short(1e6 * r.step_s)]
            for r in result.chains
        ],
        f"A step of a chain in the virtual machine; exponents: {growth or 'of two lengths only'}",
    )


def _accuracy(result: "MultibodyBenchmark") -> None:
    output.show_table(
        ["case", "t", "signal", "reference", "off by", "digits"],
        [
            [r.case, r.t, r.signal, f"{r.reference:.9g}", _short(r.value - r.reference), r.digits]
            for r in result.facts
        ],
        "Reference numbers and what ours differ by; digits: what they are good for",
    )
    output.show_table(
        ["case", "coordinates", "phi [m]", "phi_dot, relative", "phi_ddot, relative"],
        [
            [r.case, r.formulation, *map(_short, (r.phi, r.phi_dot, r.phi_ddot))]
            for r in result.norms
        ],
        "Largest norms of the constraints",
    )
    output.show_table(
        ["case", "rtol", "t_end [s]", "steps", "relative change"],
        [[r.case, r.rtol, r.t_end, r.steps, _short(r.relative)] for r in result.drifts],
        "Energy of frictionless mechanisms",
    )


def ivp(result: "IvpBenchmark") -> None:
    """Digits, steps and times, and the drift of constraints."""
    output.show_table(
        ["problem", "method", "rtol", "digits", "wanted", "steps", "time [ms]"],
        [
            [r.problem, r.method, r.rtol, round(r.scd, 1), r.wanted or "", r.steps,
             _short(1e3 * r.time_s)]
            for r in result.rows
        ],
        "Correct digits of the worst signal at the end",
    )  # fmt: skip
    output.show_table(
        ["problem", "method", "rtol", "drift"],
        [[r.problem, r.method, r.rtol, _short(r.drift)] for r in result.rows if r.drift],
        "Largest value of a constraint that is kept as an acceleration only",
    )
    _skipped({f"{r.problem}, {r.method}": r.message for r in result.rows if r.message})


def jitter(data: FigureData) -> None:
    """Total variations, a line for each law, way of stepping and velocity."""
    columns = list(data.units)
    output.show_table(
        ["law", "steps", *(f"{name} [{data.units[name]}]" for name in columns)],
        [
            [c.law, c.case, *(_short(float(c[name][k])) for name in columns)]
            for c in data.curves
            for k in range(c[columns[0]].size)
        ],
        data.title,
    )


def regularisation(result: "RegularisationBenchmark") -> None:
    """A table per case, a line per width: errors at each tolerance, order and cost."""
    for case in dict.fromkeys(row.case for row in result.rows):
        own = [row for row in result.rows if row.case == case]
        first, rtols = own[0], list(dict.fromkeys(row.rtol for row in own))
        lines = [
            [row for row in own if row.value == x] for x in dict.fromkeys(r.value for r in own)
        ]
        cyclic = any(line[-1].cycle_error == line[-1].cycle_error for line in lines)
        output.show_table(
            [f"{first.parameter} [{first.unit}]", *(f"{rtol:g}" for rtol in rtols), "order",
             *(["cycle"] if cyclic else []), "steps", "[ms]"],
            [
                [_short(line[0].value), *(_short(r.error) for r in line),
                 _known(line[-1].order, 2),
                 *([_known(line[-1].cycle_error, 3)] if cyclic else []), line[0].steps,
                 _short(1e3 * line[0].time_s)]
                for line in lines
            ],
            f"{case}: error at each rtol against {first.reference}, good for "
            f"{first.uncertain:.1g}; order and cycle at the smallest rtol, cost at the largest",
        )  # fmt: skip


def ocp(result: "OcpBenchmark") -> None:
    """Problems by solvers, sizes of programs, controllers."""
    output.show_table(
        ["case", "solver", "starts", "landed", "best", "J", "off [%]", "miss", "exact", "it.",
         "[s]"],
        [
            [r.case, r.solver, f"{r.count} {r.starts}", f"{r.landed:.0%}", f"{r.best:.0%}", r.cost,
             _known(100 * r.off, 2), _known(r.miss, 2), _known(r.exact, 2), round(r.iterations),
             _known(r.time_s, 2)]
            for r in result.rows
        ],
        "Medians; landed: missed by no more than 1e-4; exact: with exact Coulomb friction",
    )  # fmt: skip
    if result.sizes:
        output.show_table(
            ["intervals", "unknowns", "nonzeros", "build [s]", "J [ms]", "H [ms]", "exponent"],
            [
                [r.intervals, r.unknowns, r.nonzeros, _short(r.build_s), _short(r.jacobian_ms),
                 _short(r.hessian_ms), _known(r.exponent, 3)]
                for r in result.sizes
            ],
            "Derivatives of a cart-pendulum's program in the virtual machine",
        )  # fmt: skip
    if result.mpc:
        output.show_table(
            ["plant", "cycles", "median [ms]", "worst", "cpu", "QPs", "failed", "hidden", "[mm]"],
            [
                [r.plant, r.cycles, _short(r.median_ms), _short(r.worst_ms),
                 _short(r.worst_cpu_ms), r.iterations, r.unconverged, r.unreported,
                 _short(r.off_mm)]
                for r in result.mpc
            ],
            "Controller of a drive; hidden: failures that it did not report",
        )  # fmt: skip
    _skipped(result.skipped)


def identification(result: "IdentificationBenchmark") -> None:
    """Numbers beside their goals."""
    output.show_table(
        ["case", "what", "measured", "goal", "met", "cpu [s]", "note"],
        [
            [r.case, r.what, _known(r.value, 3), f"{r.better} {r.goal:g}",
             "yes" if r.met else "no", round(r.seconds, 1), r.note]
            for r in result.rows
        ],
        "Identification beside its goals",
    )  # fmt: skip


def codegen(result: "CodegenBenchmark") -> None:
    """A table a section, and its notes."""
    for name, section in result.sections.items():
        if section.rows:
            rows = [[c if isinstance(c, str) else _known(c, 4) for c in r] for r in section.rows]
            output.show_table(section.head, rows, section.title)
        for note in section.notes:
            output.show(f"{name}: {note}")


def embedded(result: "EmbeddedBenchmark") -> None:
    """Instructions and bytes, block by block and core by core."""
    if result.advice:
        output.show(f"embedded: skipped, {result.advice}")
        return
    output.show_table(
        ["block", "core", "avg", "max", "text", "data", "stack", "error", "test"],
        [
            [m.block, _core(m.core, m.real), round(m.average), round(m.maximum), round(m.text),
             round(m.data), round(m.stack), _known(m.error, 2),
             "ok" if row.wrong == 0 else f"{row.wrong} wrong"]
            for row in result.rows for m in (row.measured,)
        ],
        "gcc -O2 under QEMU, float: instructions of a step (average, maximum), bytes, largest "
        "difference from CasADi over the peak, unit test of the kit",
    )  # fmt: skip


def _core(core: str, real: str) -> str:
    return core.replace("plus", "+") + ("" if real == "float" else " f64")


def _known(value: float, digits: int) -> float | str:
    """So many digits; empty where there is no number."""
    return "" if value != value else float(f"{value:.{digits}g}")


def _skipped(reasons: dict[str, str]) -> None:
    for name, why in reasons.items():
        output.show(f"{name}: not run, {why}")


def _short(value: float) -> float:
    """Three digits."""
    return float(f"{value:.3g}")


def interop(result: "InteropBenchmark") -> None:
    """Moves by tool, route and law; CasADi's integrators; what is absent."""
    output.show_table(
        ["tool", "route", "law", "J", "miss", "it.", "s", ""],
        [
            [m.tool, m.route[:7], m.law, f"{m.cost:.3f}", _short(m.miss),
             m.iterations, f"{m.time_s:.1f}", _word(m.answer)]
            for m in result.moves
        ],
        "0.1 m in 1 s against friction: cost, miss by `simulate` with the law itself",
    )  # fmt: skip
    output.show_table(
        ["integrator", "law", "error [m]", "time ratio", ""],
        [[r.integrator, r.law, _short(r.error), _short(r.ratio), r.answer] for r in result.runs],
        "20 s of stick-slip in CasADi's integrators; time over that of symfric without compiler",
    )
    for tool in result.absent:
        output.show(f"{tool} is not installed: no rows")


def _word(answer: str) -> str:
    """The words of Ipopt, shorter; nothing where it is content."""
    known = {
        "Solve_Succeeded": "",
        "Maximum_CpuTime_Exceeded": "out of time",
        "Search_Direction_Becomes_Too_Small": "gave up",
    }
    return known.get(answer, answer.replace("_", " ").lower())
