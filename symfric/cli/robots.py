"""`symfric identify ROBOT.urdf DATA`: inertias and friction of a robot."""

from collections.abc import Callable
from pathlib import Path

from identification.data.dataset import Dataset
from identification.robot.friction import USUAL
from identification.robot.identify import identify_robot
from symfric.cli import options as opt
from symfric.cli import output
from symfric.cli.options import Strings
from symfric.foundation import checks

METHODS = {"squares": "weighted", "huber": "robust"}
"""Value of --loss -> method of `identify_robot`."""


def identify(
    data: list[str], law: Strings, validate: Strings, read: Callable[[list[str]], Dataset],
    loss: str, plot: Path | None, json: str | None, rotors: bool, urdf: Path | None,
) -> None:  # fmt: skip
    """Identify a robot, print the table and write the requested files."""
    robot, *logs = data
    if not logs:
        raise ValueError(f"identify: expected logs of the joints of '{robot}', got none")
    laws = opt.laws_of(law or [USUAL])
    if len(laws) > 1:
        raise ValueError(f"--law: expected one law for the joints of a robot, got {len(laws)}")
    method = METHODS[checks.choice("--loss of a robot", loss, [*METHODS])]
    others = read(validate) if validate else None
    fit = identify_robot(
        robot, read(logs), *laws.values(), validation=others, method=method, rotors=rotors
    )
    if plot:
        fit.plot(plot)
    if urdf:
        fit.to_urdf(urdf)
    shown = fit.shown()

    def show() -> None:
        output.show("\n".join((shown.title, *shown.lines, "")))
        output.show_table(shown.table.header, shown.table.rows)
        for text in shown.after:
            output.show(f"\n{text}")

    output.finish(fit.to_dict(), json, show, plot, urdf)
