"""`symfric demo`: simulation, identification, optimal control and generated C in one run."""

import json
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Annotated, Any

import typer

from identification.data.dataset import Dataset
from identification.data.synthetic import synthetic_drive_data
from identification.fit import Fit
from identification.residuals.inverse import InverseDynamics
from identification.result.fitted import Fitted
from ocp import Free, Solution, rest_to_rest, solve
from symfric import ALL_LAWS, LuGre, simulate
from symfric.cli import output
from symfric.cli.codegen import show_verification
from symfric.cli.options import check_folder, option
from symfric.cli.run import show_trajectory
from symfric.codegen import generate, verify
from symfric.foundation.files import write_text
from symfric.laws import Law, law_name
from symfric.scenes import Rabinowicz

STAGE = Path("..", "shared", "data", "EMPS")
"""Default folder of the measured stage: the EMPS benchmark next to the working folder."""

RECORDS = "DATA_EMPS.mat", "DATA_EMPS_PULSES.mat"
"""Record for identification and record for validation."""

DISTANCE, LIMIT = 0.05, 200.0
"""Distance of the optimal move [m] and largest force [N]."""


@dataclass(frozen=True)
class Chapter:
    """Files and numbers of one part of the demo."""

    title: str
    text: str
    files: tuple[Path, ...]
    numbers: dict[str, Any]


def demo(
    out: Annotated[Path, option("--out DIR", "Folder for the results.")] = Path("out"),
    data: Annotated[
        Path | None,
        option(
            "--data DIR",
            "Folder of the EMPS benchmark; default ../shared/data/EMPS, else a simulated record.",
        ),
    ] = None,
) -> None:
    """Simulate, identify, optimise and generate C.

    Results are written to DIR, with a README.md that lists them.

    Example: symfric demo --out out
    """
    check_folder(out)
    records, laws, origin = load_records(data)
    output.note("1/4 stick-slip with two laws")
    chapters = [stick_slip(out / "rabinowicz")]
    output.note(f"2/4 identification from {origin}")
    found = [identified(records, law) for law in laws]
    chapters.append(identification(out / "identification", found, origin, records))
    output.note("3/4 optimal moves of the identified drive")
    chapters.append(optimal_moves(out / "optimal_move", found[0]))
    output.note("4/4 C for embedded controllers")
    chapters.append(generated_c(out / "c", law_of(found[0])))
    write_text(out / "README.md", index(out, chapters))
    summary = {c.title: c.numbers for c in chapters}
    write_text(out / "summary.json", json.dumps(output.plain(summary), indent=2) + "\n")
    output.note(f"wrote {out / 'README.md'}, which lists the results")
    if chapters[-1].numbers["failed"]:
        raise typer.Exit(1)


def load_records(data: Path | None) -> tuple[tuple[Dataset, Dataset], tuple[str, ...], str]:
    """Return two records, the laws to identify from them, and their origin."""
    folder = data or (STAGE if STAGE.is_dir() else None)
    if folder is not None:
        one, other = (Dataset.read(folder / name) for name in RECORDS)
        laws = ("coulomb+viscous", "asymmetric(coulomb+viscous)")
        return (one, other), laws, f"the measured EMPS stage in {folder}"
    other = synthetic_drive_data(seed=1, speeds=(0.003, 0.02, 0.09))
    origin = "a simulated record (no measured one found; --data DIR for the EMPS benchmark)"
    return (synthetic_drive_data(), other), ("stribeck",), origin


def stick_slip(folder: Path) -> Chapter:
    """Simulate a block on a belt with a smooth law and a bristle law."""
    from symfric.figures.pictures import plot_laws  # noqa: PLC0415  (matplotlib is slow)
    from symfric.results.pictures import plot_trajectories  # noqa: PLC0415  (matplotlib is slow)

    laws = {name: ALL_LAWS[name]() for name in ("brown_mcphee", "lugre")}
    motions = {name: simulate(Rabinowicz(law).model(), 20.0) for name, law in laws.items()}
    picture, curves = folder / "rabinowicz.png", folder / "laws.png"
    plot_trajectories(motions, ("x", "v", "friction"), picture)
    plot_laws(laws, path=curves)
    tables = {name: folder / f"{name}.csv" for name in motions}
    for name, motion in motions.items():
        motion.to_csv(tables[name])
        show_trajectory(name, motion)
    return Chapter(
        "Stick-slip of a block on a belt",
        "Position, velocity and friction with Brown-McPhee and LuGre friction over 20 s.",
        (picture, curves, *tables.values()),
        {
            name: {"final": motion.final, "statistics": motion.statistics.to_dict()}
            for name, motion in motions.items()
        },
    )


def identified(records: tuple[Dataset, Dataset], law: str) -> Fitted:
    """Identify the drive from the first record, and validate it on the second."""
    with output.progress(f"identify {law}") as tell:
        fit = Fit(InverseDynamics(), law, records[0]).solve(
            progress=lambda _, fraction: tell(fraction)
        )
    found = replace(fit, validation=fit.validate(records[1]))
    typer.echo(f"{found}\n")
    return found


def law_of(found: Fitted) -> Law:
    """Return the identified law."""
    if found.law is None:
        raise ValueError(f"demo: expected a law, got none from {found.name}")
    return found.law


def identification(
    folder: Path, found: list[Fitted], origin: str, records: tuple[Dataset, Dataset]
) -> Chapter:
    """Write pages, numbers and pictures, and simulated records."""
    files: list[Path] = []
    for fit in found:
        stem = fit.name.replace("+", "_").replace("(", "_").replace(")", "")
        page, numbers, picture = (folder / f"{stem}.{kind}" for kind in ("html", "json", "png"))
        fit.to_html(page)
        fit.to_json(numbers)
        fit.plot(picture)
        files += [page, numbers, picture]
    if "simulated" in origin:
        for name, record in zip(("record", "validation"), records, strict=True):
            files += record.to_csv(folder / f"{name}.csv")
    return Chapter(
        "Identification of a positioning drive",
        f"Mass, offset and friction from {origin}.",
        tuple(files),
        {fit.name: numbers_of(fit) for fit in found} | {"data": origin},
    )


def numbers_of(fit: Fitted) -> dict[str, Any]:
    """Return the key numbers of a fit."""
    data = fit.to_dict()
    return {
        name: data[name] for name in ("status", "message", "parameters", "errors", "validation")
    }


def optimal_moves(folder: Path, found: Fitted) -> Chapter:
    """Compute the fastest move of the drive, and the move of least effort in 1.5 times that time.

    The speed is bounded by the largest one in the record, since friction is unknown beyond it.
    """
    from ocp.solving.solution import plot_solutions  # noqa: PLC0415  (matplotlib is slow)

    speed = 0.1 if found.curve is None else float(abs(found.curve.law.t).max())

    def move(T: float | Free) -> Solution:
        problem = rest_to_rest(found.model, DISTANCE, T, limit=LIMIT)
        bounded = replace(problem, bounds={**problem.bounds, "v": (-speed, speed)})
        return solve(bounded, intervals=100)

    fastest = move(Free(0.05, 10.0, guess=0.5))
    moves = {"minimum time": fastest, "minimum effort": move(1.5 * fastest.T)}
    picture = folder / "moves.png"
    plot_solutions(moves, ("x", "v", "force", "friction"), picture)
    files = [picture]
    for name, solution in moves.items():
        table, numbers = (folder / f"{name.replace(' ', '_')}.{kind}" for kind in ("csv", "json"))
        solution.to_csv(table)
        solution.to_json(numbers)
        files += [table, numbers]
    show_moves(moves)
    return Chapter(
        "Optimal moves of the identified drive",
        f"{DISTANCE:g} m from rest to rest with at most {LIMIT:g} N and {speed:.3g} m/s, the "
        "largest speed in the record: the fastest move, and the move of least effort (integral of "
        "force^2) in 1.5 times that time; each control is verified by simulation.",
        tuple(files),
        {
            name: {n: getattr(solution, n) for n in ("T", "cost", "miss", "iterations")}
            | {"status": solution.status.name}
            for name, solution in moves.items()
        },
    )


def show_moves(moves: dict[str, Solution]) -> None:
    """Print duration, peak force and the relative miss of the simulated moves."""
    output.show_table(
        ["move", "status", "iterations", "duration T [s]", "peak force [N]", "relative miss"],
        [
            (
                name,
                move.status.name.lower(),
                move.iterations,
                move.T,
                float(abs(move["force"]).max()),
                f"{move.miss:.1g}",
            )
            for name, move in moves.items()
        ],
        title=f"{DISTANCE:g} m from rest to rest, |force| <= {LIMIT:g} N",
    )
    output.show()


def generated_c(folder: Path, stage: Law) -> Chapter:
    """Generate C of LuGre, and of the identified law for friction compensation."""
    files: list[Path] = []
    numbers: dict[str, Any] = {"failed": False}
    for name, law in {"lugre": LuGre(), "stage_friction": stage}.items():
        generated = generate(law, folder / name, name=name)
        verification = verify(generated)
        findings = folder / name / "verification.json"
        write_text(findings, json.dumps(output.plain(verification.to_dict()), indent=2) + "\n")
        show_verification(verification)
        output.show()
        files += [*generated.files, findings]
        numbers[name] = {"law": law_name(law), **verification.to_dict()}
        numbers["failed"] |= bool(verification.checks) and not verification.ok
    return Chapter(
        "C for embedded controllers",
        "LuGre with its exact exponential update, and the identified friction for feed-forward "
        "compensation; both compared with CasADi if there is a C compiler.",
        tuple(files),
        numbers,
    )


def index(out: Path, chapters: list[Chapter]) -> str:
    """Return a list of the results in Markdown."""
    lines = ["# Results of `symfric demo`", ""]
    for chapter in chapters:
        lines += [f"## {chapter.title}", "", chapter.text, ""]
        for path in sorted(chapter.files, key=lambda path: path.suffix != ".png"):
            place = path.relative_to(out).as_posix()
            picture = path.suffix == ".png"
            lines.append(f"![{path.stem}]({place})\n" if picture else f"- [{place}]({place})")
        lines.append("")
    return "\n".join([*lines, "`summary.json` contains the key numbers of all parts.", ""])
