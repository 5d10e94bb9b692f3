"""`symfric bench`: run time against error, as ratios measured in one run."""

from typing import Annotated

import typer

from symfric.cli import output
from symfric.cli.options import JsonOption, PlotOption, check_outputs
from symfric.parameters import check_names

SUBJECTS = ("integrator",)


def bench(
    subject: Annotated[str, typer.Argument(help="What to measure: integrator.")] = "integrator",
    quick: Annotated[bool, typer.Option("--quick", help="Fewer points, no SciPy.")] = False,
    plot: PlotOption = None,
    json: JsonOption = None,
) -> None:
    """Measure symfric beside other integrators: time, error and ratios at equal error.

    Example: symfric bench integrator --plot bench.png
    """
    from symfric.bench import bench_integrator  # noqa: PLC0415  (only this command needs it)

    check_names("bench", [subject], SUBJECTS)
    check_outputs(json, picture=plot)
    with output.progress("measuring") as tell:
        result = bench_integrator(quick=quick, progress=lambda _, fraction: tell(fraction))
    if plot:
        result.plot(plot)
    output.emit_json(result.to_dict(), json)
    if json != "-":
        output.show_table(
            ["case", "integrator", "rtol", "error", "time [ms]", "steps"],
            [
                [r.case, r.integrator, r.rtol, float(f"{r.error:.2g}"), 1e3 * r.time_s, r.steps]
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
        for name, why in result.skipped.items():
            output.show(f"{name}: not run, {why}")
    output.say_written(plot, json)
