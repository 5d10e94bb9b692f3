"""`symfric export-fmu`: export a scene or a model of a Python file as Functional Mock-up Unit."""

from pathlib import Path
from typing import Annotated, Any

from symfric.cli import completions, output
from symfric.cli import options as opt
from symfric.cli.machines import LawOfOption, PresetOption, scenes_with
from symfric.cli.options import argument, option
from symfric.fmu import Exported
from symfric.fmu import export_fmu as exported
from symfric.fmu.export import KINDS
from symfric.foundation import checks
from symfric.model import Model
from symfric.scenes import Scene

DEFAULT_NAME = "model"
"""Default name of the model in a Python file."""


def export_fmu(
    what: Annotated[
        str,
        argument(
            "SCENE|FILE.urdf|FILE.py[:NAME]",
            "A scene, a robot, or a `Model` (or a function that returns one) in a file.",
            completions.scenes,
        ),
    ],
    out: Annotated[Path | None, option("--out FILE.fmu", "Default: the name of the model.")] = None,
    law: Annotated[
        str | None, option("--law NAME", "Friction law of a scene.", completions.laws)
    ] = None,
    settings: opt.SetOption = None,
    preset: PresetOption = None,
    law_of: LawOfOption = None,
    free: Annotated[
        list[str] | None,
        option(
            "--free NAME",
            "Make only these parameters tunable; default: all that are not zero.",
        ),
    ] = None,
    fmi: Annotated[int, option("--fmi 2|3", "Version of the standard.")] = 3,
    kind: Annotated[str, option("--kind NAME", f"{' or '.join(KINDS)}.")] = KINDS[0],
    rtol: Annotated[
        float, option("--rtol NUMBER", "Relative tolerance of a step; tunable in the FMU.")
    ] = 1e-6,
    step_size: Annotated[
        float | None, option("--step-size SECONDS", "Use fixed steps of this length.")
    ] = None,
    method: Annotated[str, option("--method NAME", "Method, as for `run` and `codegen`.")] = "auto",
    t_end: Annotated[
        float | None, option("--t-end SECONDS", "Stop time of the default experiment.")
    ] = None,
    name: Annotated[
        str | None, option("--name NAME", "Model identifier; default: that of the model.")
    ] = None,
    json: opt.JsonOption = None,
) -> None:
    """Write a scene or a model as a Functional Mock-up Unit.

    The FMU contains sources and the binary of this platform and needs neither Python nor CasADi. It
    takes the steps of `symfric run`, for any communication step.

    Example: symfric export-fmu drive --law lugre --fmi 2 --out drive.fmu

    Example: symfric export-fmu press.py:model --rtol 1e-8
    """
    opt.check_outputs(out, json)
    make = from_file if ".py" in what else scene_of
    model = make(what, law, opt.assignments("--set", settings), preset, law_of)
    unit = exported(
        model,
        Path(f"{named(model, what)}.fmu") if out is None else out,
        fmi=fmi,
        kind=kind,
        rtol=rtol,
        step=step_size,
        method=method,
        free=free,
        t_end=t_end,
        name=name,
    )
    output.finish(to_dict(unit), json, lambda: output.show(str(unit)), unit.path)


def named(model: Model | Scene, what: str) -> str:
    """Return the file name of the FMU without suffix."""
    return model.name if isinstance(model, Model) else Path(what).stem


def scene_of(
    what: str,
    law: str | None,
    settings: dict[str, str],
    preset: str | None,
    law_of: list[str] | None,
) -> Scene:
    """Return the scene or robot with its law.

    Raises:
        ValueError: no law, or unknown names.
    """
    if law is None:
        raise ValueError(f"export-fmu {what}: expected --law NAME, got none; such as --law lugre")
    return scenes_with(what, [law], settings, preset, law_of)[law]


def from_file(
    what: str,
    law: str | None,
    settings: dict[str, str],
    preset: str | None,
    law_of: list[str] | None,
) -> Model | Scene:
    """Return the model in a Python file.

    Raises:
        ValueError: no such file or name, an error in the file, or an object of another type.
    """
    given = {"--law": law, "--preset": preset, "--law-of": law_of}
    for name, value in given.items():
        if value:
            raise ValueError(f"{name}: expected none with '{what}', which has its laws")
    kind = Model | Scene
    values = {n: checks.parsed(f"--set {n}", text) for n, text in settings.items()}
    return opt.held_by_file("export-fmu", what, DEFAULT_NAME, values, "Model", kind)


def to_dict(unit: Exported) -> dict[str, Any]:
    """Return the content of `--json`."""
    names = ("size", "fmi", "kind", "identifier", "binary", "missing", "method")
    variables = {
        entry.name: {"reference": entry.reference, "causality": entry.causality}
        for entry in unit.variables
    }
    own = {name: getattr(unit, name) for name in names}
    return {"file": str(unit.path), **own, "variables": variables}
