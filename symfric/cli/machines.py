"""Scenes according to command line options: laws, preset, parameters, inputs, start values."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from inspect import isclass, signature
from math import isnan, nan
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar, NamedTuple, final

import numpy as np

from symfric import Law, Linear, parameters, rate_of, with_values
from symfric.cli.options import assignments, named_in_file, named_law, numbers
from symfric.foundation import checks
from symfric.foundation.numeric import Array
from symfric.foundation.parameters import check_names, options
from symfric.foundation.units import parsed
from symfric.integrator import Input
from symfric.integrator.equations.inputs import Sampled
from symfric.model import Model, Variables
from symfric.model.model import check_model
from symfric.scenes import ALL_SCENES, Scene

if TYPE_CHECKING:
    from identification.data.raw import Column, Raw


@final
@dataclass(frozen=True, eq=False, repr=False)
class OwnMachine(Scene):
    """Machine of a user's file.

    Attributes:
        source: FILE.py[:NAME].
        make: function law -> Model; further arguments with defaults are parameters.
        values: values of these parameters.
    """

    t_end: ClassVar[float] = nan

    source: str
    make: Callable[..., Model]
    values: Mapping[str, float] = field(default_factory=dict[str, float])

    @property
    def arguments(self) -> list[str]:
        """Names of the parameters."""
        return [*signature(self.make).parameters][1:]

    def equations(self, p: Variables) -> Model:
        """Return the model of the file."""
        model = self.make(self.law, **self.values)
        check_model(f"'{self.source}'", model)
        return model


def kind_of(
    scene: str, where: str = "scene", preset: str | None = None, law_of: Sequence[str] | None = None
) -> Callable[[Law], Scene]:
    """Return a function law -> scene, for a scene by name, a URDF file or a machine of a file.

    Args:
        scene: name, FILE.urdf, or FILE.py[:NAME] of a function law -> Model or a class of scenes.
        where: name of the argument, for messages.
        preset: value of --preset.
        law_of: texts of --law-of.

    Raises:
        ValueError: an unknown scene, preset, place or law.
    """
    others = {place: named_law(text) for place, text in assignments("--law-of", law_of).items()}
    if scene.endswith(".urdf"):
        from symfric.multibody.urdf import relative  # noqa: PLC0415  (for robots only)
        from symfric.scenes import Robot  # noqa: PLC0415  (for robots only)

        check_names("--preset of a robot", [preset] if preset else [], ())
        laws = tuple(relative(law) for law in others.values())
        return lambda law: Robot(relative(law), scene, tuple(others), laws)
    if ".py" in scene:
        _, found = named_in_file(where, scene, "machine", callable)
        if not callable(found):
            raise checks.refused(f"{where} '{scene}'", "a function law -> Model, or a scene", found)
        kind: Any = found
        if not (isclass(found) and issubclass(found, Scene)):
            check_names(f"--preset of {scene}", [preset] if preset else [], ())
            check_names(f"--law-of of {scene}", others, ())
            return partial(OwnMachine, source=scene, make=kind)
    else:
        check_names(where, [scene], ALL_SCENES)
        kind = ALL_SCENES[scene]
    check_names(
        f"--law-of of {scene}", others, kind.places(), "--law is the law of the main contact"
    )
    if preset is not None:
        check_names(f"--preset of {scene}", [preset], kind.presets)
        return partial(kind.preset, preset, **others)
    return partial(kind, **others) if others else kind


def scenes_with(
    scene: str,
    laws: Mapping[str, Law],
    settings: Sequence[str] | None,
    preset: str | None = None,
    law_of: Sequence[str] | None = None,
) -> dict[str, Scene]:
    """Return the scene with each of the laws, by name of the law.

    Args:
        scene: see `kind_of`.
        laws: laws by name.
        settings: texts of --set: parameters of the scene and the laws, forms of the laws, and
            structure of the scene; they override a preset.
        preset: value of --preset.
        law_of: texts of --law-of.

    Raises:
        ValueError: an unknown law, or a parameter that none of the scenes has; see also `kind_of`.
    """
    kind, texts = kind_of(scene, preset=preset, law_of=law_of), assignments("--set", settings)
    machines = {text: kind(law) for text, law in laws.items()}
    known = {law: settable(machine, texts) for law, machine in machines.items()}
    check_names(f"--set of {scene}", texts, dict.fromkeys(n for own in known.values() for n in own))
    return {
        law: with_set(machine, {n: text for n, text in texts.items() if n in known[law]})
        for law, machine in machines.items()
    }


def settable(machine: Scene, texts: Mapping[str, str]) -> list[str]:
    """Return the names that --set accepts for a scene with the forms in `texts`."""
    return [*parameters(formed(machine, texts)), *forms(machine)]


def with_set(machine: Scene, texts: Mapping[str, str]) -> Scene:
    """Return the scene with the parameters, the forms and the structure in `texts`."""
    values = numbers("--set", {n: t for n, t in texts.items() if n not in forms(machine)})
    return with_values(formed(machine, texts), values)


def formed(machine: Scene, texts: Mapping[str, str]) -> Scene:
    """Return the scene with the forms and the structure in `texts`; other names are ignored.

    Raises:
        ValueError: a text that is neither one of the choices nor a count, true or false.
    """
    law = {n: text for n, text in texts.items() if n in options(machine.law)}
    if law:
        machine = replace(machine, law=replace(machine.law, **law))
    own: dict[str, str | bool | int] = {n: texts[n] for n in options(machine) if n in texts}
    for name in machine.structures():
        if name in texts:
            own[name] = _structure(f"--set {name}", texts[name], getattr(machine, name))
    if isinstance(machine, OwnMachine):
        values = numbers("--set", {n: texts[n] for n in machine.arguments if n in texts})
        return replace(machine, values=values, **own)
    return replace(machine, **own) if own else machine


def _structure(where: str, text: str, like: bool | int) -> bool | int:
    """Return a text converted to the type of `like`."""
    if isinstance(like, bool):
        return checks.choice(where, text, ("true", "false")) == "true"
    number = checks.parsed(where, text)
    return int(number) if number.is_integer() else checks.count(where, number)


def forms(machine: Scene) -> list[str]:
    """Return the names of a scene that --set accepts in addition to parameters."""
    own = machine.arguments if isinstance(machine, OwnMachine) else machine.structures()
    return [*options(machine.law), *options(machine), *own]


class Driven(NamedTuple):
    """Inputs, start values and end time of a run.

    Attributes:
        signals: inputs by name.
        texts: inputs as texts, in the form of the command line.
        start: state -> value.
        until: end time [s].
    """

    signals: dict[str, Input]
    texts: dict[str, str]
    start: dict[str, float]
    until: float


def driven(
    scene: Scene,
    model: Model,
    texts: Sequence[str] | None = None,
    x0: Sequence[str] | None = None,
    t_end: float | None = None,
) -> Driven:
    """Return inputs, start values and end time for the texts of --input, --x0 and --t-end.

    Inputs that are not given are those of the scene. The default end time is that of the samples,
    or otherwise that of the scene. Samples of a state whose rate is an input (`Scene.integrals`)
    determine this input and the start value of the state.

    Raises:
        ValueError: unknown names, or an input together with its integral; see also
            `input_from_text`.
    """
    given, units = assignments("--input", texts), {v.name: v.unit for v in model.u}
    rates = {state: rate for state, rate in scene.integrals.items() if rate in units}
    units |= {v.name: v.unit for v in model.x if v.name in rates}
    check_names(f"--input of {model.name}", given, units)
    signals: dict[str, Input] = {}
    written, start = dict(given), dict[str, float]()
    for name, text in given.items():
        signal, rate = input_from_text(name, text, units[name]), rates.get(name)
        if rate is None:
            signals[name] = signal
            continue
        if rate in given:
            raise ValueError(f"--input: expected {name} or its rate {rate}, got both")
        signals[rate] = rate_of(signal)
        first = signal.values if isinstance(signal, Linear) else signal
        start[name] = float(np.ravel(first)[0])
    for name, own in scene.inputs.items():
        if name not in signals:
            signals[name], written[name] = own.function, own.text
    ends = [float(np.max(s.t)) for s in signals.values() if isinstance(s, Sampled)]
    until = max(ends, default=scene.t_end) if t_end is None else t_end
    if t_end is None and isnan(until):
        raise ValueError("--t-end: expected the end time of a machine of a file, got none")
    return Driven(signals, written, start | numbers("--x0", x0), until)


def input_from_text(name: str, text: str, unit: str) -> Linear | float:
    """Return the input `2.0`, or `FILE.csv:COLUMN` interpolated linearly over the column t.

    Units in the header are converted to SI, as in `symfric identify`; columns without a unit have
    SI units.

    Args:
        name: name of the input.
        text: text after the equals sign.
        unit: SI unit of the input.

    Raises:
        ValueError: neither a finite number nor a column of a readable file; a missing or repeated
            column, an incompatible unit, a row without numbers, or times that do not increase.
        OSError: the file cannot be read.
    """
    try:
        value = float(text)
    except ValueError:
        file, _, column = text.rpartition(":")
        if not file or not column:
            raise ValueError(
                f"--input {name}: expected a number or FILE.csv:COLUMN, got '{text}'"
            ) from None
    else:
        return checks.number(f"--input {name}", value)
    from identification.data.raw import label  # noqa: PLC0415 (slow to import)
    from identification.data.reading import gathered  # noqa: PLC0415
    from identification.data.text import read_text  # noqa: PLC0415 (slow to import)

    place = Path(file)
    if not place.is_file():
        got = "a folder" if place.is_dir() else "nothing there; check the path"
        raise ValueError(f"read '{file}': expected a file, got {got}")
    raw = read_text(place)
    times = [c for c in raw.columns if c.label in ("t", "time", "Time")]
    meant = label(column)
    hits = [c for c in raw.columns if (c.label, c.unit) == meant]
    hits = hits or [c for c in raw.columns if c.label == meant[0]]
    wanted = (("t", times, "s"), (meant[0], hits, unit))
    columns = gathered([partial(_in_si, raw, *given) for given in wanted])
    try:
        return Linear(*columns)
    except ValueError as error:
        raise ValueError(f"read '{place.name}': {error}") from None


def _in_si(raw: "Raw", name: str, hits: Sequence["Column"], unit: str) -> Array:
    """Return the numbers of the only column in `hits` in the SI unit `unit`.

    Raises:
        ValueError: not one column, another dimension, or a bad cell.
    """
    from identification.data.units import CHANNELS  # noqa: PLC0415 (slow to import)
    from identification.data.units import unit as of_signal  # noqa: PLC0415 (slow to import)

    where = f"read '{raw.name}'"
    if len(hits) != 1:
        got = ", ".join(str(c) for c in hits or raw.columns if c.label) or "no header"
        raise ValueError(
            f"{where}: expected one column '{name} [{unit}]', got {got}; check the header"
        )
    (column,) = hits
    if column.problem:
        raise ValueError(f"{where}: column '{column}', {column.problem}")
    if column.unit in ("", unit):
        return column.values
    si = parsed(unit)
    for meant in (parsed(column.unit), of_signal(column.unit)):
        if meant and si and meant.powers == si.powers:
            return meant.factor / si.factor * column.values
    usual = (channel.examples for channel in CHANNELS.values() if unit in channel.units)
    raise ValueError(
        f"{where}: column '{column}': expected a unit of {next(usual, unit)} in brackets, "
        f"got {column.unit}"
    )
