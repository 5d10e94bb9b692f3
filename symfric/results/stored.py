"""Files of runs, ensembles, fits and optimal motions, and statistics of simulations.

Files are written atomically, and objects are restored exactly. `symfric.foundation.packed` converts
objects to arrays.
"""

from collections.abc import Callable, Iterable, Mapping
from dataclasses import asdict, dataclass, field
from importlib import import_module
from os import PathLike
from typing import Any, Generic, TypeVar, final

from symfric.foundation import checks, packed
from symfric.foundation.files import written

T = TypeVar("T")


@final
@dataclass(frozen=True)
class Format(Generic[T]):
    """Format of a file.

    Attributes:
        kind: name of the file type in the file.
        number: version; it is increased if older programs would misread the file. Older versions
            can be read.
        reader: name of the function that reads the file, such as "load_run", for messages.
        what: description of the content, such as "a saved run".
        content: class of the content.
    """

    kind: str
    number: int
    reader: str
    what: str
    content: type[T]

    def save(self, path: str | PathLike[str], thing: T) -> None:
        """Write `thing` to a file.

        Raises:
            ValueError: the file cannot be written, or a file cannot contain some part of `thing`.
        """
        with written(checks.path("output", path)) as temporary, temporary.open("wb") as file:
            packed.dump(file, thing, self.kind, self.number)

    def load(self, path: str | PathLike[str], own: Iterable[type | Callable[..., Any]] = ()) -> T:
        """Return the object that `save` wrote; no code in the file is executed.

        Args:
            path: file to read.
            own: classes and functions of the user that the file contains.

        Raises:
            ValueError: the file does not exist, has another format, is damaged, was written by a
                newer version, or contains unknown classes.
        """
        place, where = checks.path(self.reader, path), f"{self.reader} '{path}'"
        try:
            with place.open("rb") as file:
                found = packed.load(file, self.kind, self.number, own, self.reader)
        except OSError as error:
            reason = "a folder" if isinstance(error, IsADirectoryError) else "an unreadable file"
            reason = "no such file" if isinstance(error, FileNotFoundError) else reason
            raise ValueError(f"{where}: expected {self.what}, got {reason}") from None
        except ValueError as error:
            raise ValueError(f"{where}: {error}") from None
        return checks.kind(where, found, self.content, self.what)


def module(where: str, name: str) -> Any:
    """Import and return an optional package.

    Raises:
        ImportError: the package is not installed.
    """
    try:
        return import_module(name)
    except ImportError:
        raise ImportError(
            f"{where}: expected the package {name}, got none; install it by 'pip install {name}', "
            "or use to_csv, which needs no package"
        ) from None


@dataclass(frozen=True)
class Statistics:
    """Statistics of a simulation: cost and measured errors.

    Attributes:
        backend: "vm" or "compiled".
        method: integration method.
        steps, rejections: numbers of accepted and rejected steps.
        evaluations, jacobians, factorisations: numbers of evaluations of the right-hand side and of
            its Jacobian, and of LU factorisations.
        events: number of events.
        smallest_step: smallest accepted step [s].
        build_time, compile_time, run_time: wall times [s] to build the integrator (0 if it is
            reused), to compile it, and to run it.
        error: largest measured error of a state relative to its magnitude; NaN if not requested.
        sensitivity_errors: largest measured error of the derivatives by each requested name,
            relative to the largest value of the derivative of the same state; NaN if there is none.
    """

    backend: str
    method: str
    steps: int
    rejections: int
    evaluations: int
    jacobians: int
    factorisations: int
    events: int
    smallest_step: float
    build_time: float
    compile_time: float
    run_time: float
    error: float = float("nan")
    sensitivity_errors: Mapping[str, float] = field(default_factory=dict[str, float])

    def to_dict(self) -> dict[str, Any]:
        """Return the fields by name; errors that were not measured are omitted."""
        return {k: v for k, v in asdict(self).items() if v == v and v != {}}
