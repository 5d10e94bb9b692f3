"""`symfric demo`: simulation, identification, optimal control and generated C in one run."""

from dataclasses import replace
from pathlib import Path
from typing import Any, NamedTuple

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
from symfric.cli.run import show_trajectory
from symfric.codegen import generate, verify
from symfric.foundation.files import check_folder, write_text
from symfric.laws import Law, law_name
from symfric.scenes import Rabinowicz

STAGE = Path("..", "shared", "data", "EMPS")
"""Default folder of the records of the EMPS benchmark, next to the working folder."""

RECORDS = "DATA_EMPS.mat", "DATA_EMPS_PULSES.mat"
"""Files of the records for identification and for validation."""

DISTANCE, LIMIT, INTERVALS = 0.05, 200.0, 100
"""Distance of the optimal move [m], largest force [N], and intervals of its mesh."""


class Chapter(NamedTuple):
    """Folder and numbers of one part of the demo."""

    folder: Path
    title: str
    text: str
    numbers: dict[str, Any]


def demo(out: Path = Path("out"), data: Path | None = None) -> None:
    """Simulate, identify, optimise and generate C.

    The results are written to DIR; README.md there lists them.

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
    chapters.append(generated_c(out / "c", found[0]))
    write_text(out / "README.md", index(out, chapters))
    output.emit_json({c.title: c.numbers for c in chapters}, out / "summary.json")
    output.note(f"wrote {out / 'README.md'}, which lists the results")
    if chapters[-1].numbers["failed"]:
        raise typer.Exit(1)


def load_records(data: Path | None) -> tuple[tuple[Dataset, Dataset], tuple[str, ...], str]:
    """Return two records, the laws to identify from them, and the origin of the records."""
    folder = data or (STAGE if STAGE.is_dir() else None)
    if folder is not None:
        one, other = (Dataset.read(folder / name) for name in RECORDS)
        laws = ("coulomb+viscous", "asymmetric(coulomb+viscous)")
        return (one, other), laws, f"the measured EMPS stage in {folder}"
    other = synthetic_drive_data(seed=1, speeds=(0.003, 0.02, 0.09))
    origin = "a simulated record (no measured one found; --data DIR for the EMPS benchmark)"
    return (synthetic_drive_data(), other), ("stribeck",), origin


def stick_slip(folder: Path) -> Chapter:
    """Simulate a block on a belt with a smooth law and with a bristle law."""
    from symfric.figures.pictures import plot_laws  # noqa: PLC0415  (matplotlib is slow)
    from symfric.results.pictures import plot_trajectories  # noqa: PLC0415  (matplotlib is slow)

    laws = {name: ALL_LAWS[name]() for name in ("brown_mcphee", "lugre")}
    motions = {name: simulate(Rabinowicz(law).model(), 20.0) for name, law in laws.items()}
    plot_trajectories(motions, ("x", "v", "friction"), folder / "rabinowicz.png")
    plot_laws(laws, path=folder / "laws.png")
    numbers: dict[str, Any] = {}
    for name, motion in motions.items():
        motion.to_csv(folder / f"{name}.csv")
        show_trajectory(name, motion)
        numbers[name] = {"final": motion.final, "statistics": motion.statistics.to_dict()}
    text = "Position, velocity and friction with Brown-McPhee and LuGre friction over 20 s."
    return Chapter(folder, "Stick-slip of a block on a belt", text, numbers)


def identified(records: tuple[Dataset, Dataset], law: str) -> Fitted:
    """Identify the drive from the first record, and validate it on the second."""
    with output.progress(f"identify {law}") as tell:
        fit = Fit(InverseDynamics(), law, records[0]).solve(progress=tell)
    found = replace(fit, validation=fit.validate(records[1]))
    typer.echo(f"{found}\n")
    return found


def identification(
    folder: Path, found: list[Fitted], origin: str, records: tuple[Dataset, Dataset]
) -> Chapter:
    """Write pages, numbers and pictures of the fits, and the records if they are simulated."""
    numbers: dict[str, Any] = {}
    for fit in found:
        stem = fit.name.replace("+", "_").replace("(", "_").replace(")", "")
        fit.to_html(folder / f"{stem}.html")
        fit.to_json(folder / f"{stem}.json")
        fit.plot(folder / f"{stem}.png")
        keys = ("status", "message", "parameters", "errors", "validation")
        numbers[fit.name] = {key: fit.to_dict()[key] for key in keys}
    if "simulated" in origin:
        for name, record in zip(("record", "validation"), records, strict=True):
            record.to_csv(folder / f"{name}.csv")
    text = f"Mass, offset and friction from {origin}."
    title = "Identification of a positioning drive"
    return Chapter(folder, title, text, numbers | {"data": origin})


def optimal_moves(folder: Path, found: Fitted) -> Chapter:
    """Compute the fastest move of the drive, and the move of least effort in 1.5 times that time.

    The largest speed in the record bounds the speed, since friction is unknown beyond it.
    """
    from ocp.solving.solution import plot_solutions  # noqa: PLC0415  (matplotlib is slow)

    speed = 0.1 if found.curve is None else float(abs(found.curve.law.t).max())

    def move(T: float | Free) -> Solution:
        problem = rest_to_rest(found.model, DISTANCE, T, limit=LIMIT)
        bounded = replace(problem, bounds={**problem.bounds, "v": (-speed, speed)})
        return solve(bounded, intervals=INTERVALS)

    fastest = move(Free(0.05, 10.0, guess=0.5))
    moves = {"minimum time": fastest, "minimum effort": move(1.5 * fastest.T)}
    plot_solutions(moves, ("x", "v", "force", "friction"), folder / "moves.png")
    rows: list[tuple[str | float, ...]] = []
    numbers: dict[str, Any] = {}
    for name, solution in moves.items():
        solution.to_csv(folder / f"{name.replace(' ', '_')}.csv")
        solution.to_json(folder / f"{name.replace(' ', '_')}.json")
        numbers[name] = {n: getattr(solution, n) for n in ("T", "cost", "miss", "iterations")}
        numbers[name]["status"] = solution.status.name
        peak, miss = float(abs(solution["force"]).max()), f"{solution.miss:.1g}"
        status = solution.status.name.lower()
        rows.append((name, status, solution.iterations, solution.T, peak, miss))
    output.show_table(
        ["move", "status", "iterations", "duration T [s]", "peak force [N]", "relative miss"],
        rows,
        title=f"{DISTANCE:g} m from rest to rest, |force| <= {LIMIT:g} N",
    )
    output.show()
    text = (
        f"{DISTANCE:g} m from rest to rest with at most {LIMIT:g} N and {speed:.3g} m/s, the "
        "largest speed in the record: the fastest move, and the move of least effort (integral of "
        "force^2) in 1.5 times that time; each control is verified by simulation."
    )
    return Chapter(folder, "Optimal moves of the identified drive", text, numbers)


def generated_c(folder: Path, found: Fitted) -> Chapter:
    """Generate C for LuGre, and for the identified law for friction compensation."""
    laws: dict[str, Law | None] = {"lugre": LuGre(), "stage_friction": found.law}
    numbers: dict[str, Any] = {"failed": False}
    for name, law in laws.items():
        if law is None:
            raise ValueError(f"demo: expected a law, got none from {found.name}")
        verification = verify(generate(law, folder / name, name=name))
        output.emit_json(verification.to_dict(), folder / name / "verification.json")
        show_verification(verification)
        output.show()
        numbers[name] = {"law": law_name(law), **verification.to_dict()}
        numbers["failed"] |= bool(verification.checks) and not verification.ok
    text = (
        "LuGre with its exact exponential update, and the identified friction for feed-forward "
        "compensation; both compared with CasADi if there is a C compiler."
    )
    return Chapter(folder, "C for embedded controllers", text, numbers)


def index(out: Path, chapters: list[Chapter]) -> str:
    """Return a list of the results in Markdown, pictures first."""
    lines = ["# Results of `symfric demo`", ""]
    for chapter in chapters:
        lines += [f"## {chapter.title}", "", chapter.text, ""]
        files = sorted(path for path in chapter.folder.rglob("*") if path.is_file())
        for path in sorted(files, key=lambda path: path.suffix != ".png"):
            place = path.relative_to(out).as_posix()
            picture = path.suffix == ".png"
            lines.append(f"![{path.stem}]({place})\n" if picture else f"- [{place}]({place})")
        lines.append("")
    return "\n".join([*lines, "`summary.json` contains the key numbers of all parts.", ""])
