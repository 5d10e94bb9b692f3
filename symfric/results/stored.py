"""Files of runs, ensembles, fits and optimal motions, and packages for tables.

Files are written atomically and restored bit for bit. `symfric.foundation.packed` converts objects
to arrays.
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
    """Kind of file.

    Attributes:
        kind: name of the file type in the file.
        number: raised whenever older programs would misread it; older formats are read.
        reader: function that reads it, for messages: "load_run".
        what: content in words: "a saved run".
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
            ValueError: the file cannot be written, or `thing` contains an object that a file cannot
                hold.
        """
        with written(checks.path("output", path)) as temporary, temporary.open("wb") as file:
            packed.dump(file, thing, self.kind, self.number)

    def load(self, path: str | PathLike[str], own: Iterable[type | Callable[..., Any]] = ()) -> T:
        """Return the object that `save` wrote; reading runs no code from the file.

        Args:
            path: the file.
            own: the user's classes and functions in it.

        Raises:
            ValueError: no such file, another or a damaged one, one of a newer version, or unknown
                classes.
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
    """Import an optional package.

    Raises:
        ImportError: it is not installed.
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
    """Cost of a simulation.

    Attributes:
        backend: "vm" or "compiled".
        method: integration method.
        steps, rejections: accepted and rejected steps.
        evaluations, jacobians, factorisations: calls of the right-hand side, of its Jacobian, and
            LU factorisations.
        events: events that happened.
        smallest_step: smallest accepted step [s].
        build_time, compile_time, run_time: wall time [s] for making the integrator (0 if it is
            reused), compiling it, and running it.
        error: measured error relative to each state's magnitude, the largest; NaN if not requested.
        sensitivity_errors: measured error of derivatives by each requested name, relative
            to the largest value of each state's derivative, the largest; NaN if there is none.
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
        """Return the fields by name; errors that were not measured are left out."""
        return {k: v for k, v in asdict(self).items() if v == v and v != {}}
