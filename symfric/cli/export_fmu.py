"""`symfric export-fmu`: export a scene or a model in a Python file as Functional Mock-up Unit."""

from pathlib import Path
from typing import Any

from symfric.cli import options as opt
from symfric.cli import output
from symfric.cli.machines import OwnMachine, scenes_with
from symfric.cli.options import Strings
from symfric.fmu import Exported
from symfric.fmu import export_fmu as exported
from symfric.fmu.export import KINDS
from symfric.model import Model
from symfric.scenes import Scene


def export_fmu(
    what: str,
    out: Path | None = None,
    law: str | None = None,
    settings: Strings = None,
    preset: str | None = None,
    law_of: Strings = None,
    free: Strings = None,
    fmi: int = 3,
    kind: str = KINDS[0],
    rtol: float = 1e-6,
    step_size: float | None = None,
    method: str = "auto",
    t_end: float | None = None,
    name: str | None = None,
    json: str | None = None,
) -> None:
    """Write a scene or a model as a Functional Mock-up Unit.

    The FMU contains sources and the binary for this platform, and needs neither Python nor CasADi.
    It takes the same steps as `symfric run`, for any communication step.

    Example: symfric export-fmu drive --law lugre --fmi 2 --out drive.fmu

    Example: symfric export-fmu press.py:model --rtol 1e-8

    Example: symfric export-fmu press.py:press --law lugre
    """
    opt.check_outputs(out, json)
    if ".py" in what and law is None:
        for option, value in {"--preset": preset, "--law-of": law_of}.items():
            if value:
                raise ValueError(f"{option}: expected none with '{what}' without --law")
        values = opt.numbers("--set", settings)
        model = opt.held_by_file("export-fmu", what, "model", values, "Model", Model | Scene)
    elif law is None:
        raise ValueError(f"export-fmu {what}: expected --law NAME, got none; such as --law lugre")
    else:
        model = scenes_with(what, {law: opt.named_law(law)}, settings, preset, law_of)[law]
        model = model.model() if isinstance(model, OwnMachine) else model
    stem = model.name if isinstance(model, Model) else Path(what).stem
    unit = exported(
        model,
        Path(f"{stem}.fmu") if out is None else out,
        fmi=fmi,
        kind=kind,
        rtol=rtol,
        step=step_size,
        method=method,
        free=free,
        t_end=t_end,
        name=name,
    )
    output.finish(to_dict(unit), json, lambda: output.show(str(unit)), (unit.path, None))


def to_dict(unit: Exported) -> dict[str, Any]:
    """Return the content of `--json`."""
    names = ("size", "fmi", "kind", "identifier", "binary", "missing", "method")
    variables = {
        entry.name: {"reference": entry.reference, "causality": entry.causality}
        for entry in unit.variables
    }
    own = {name: getattr(unit, name) for name in names}
    return {"file": str(unit.path), **own, "variables": variables}
