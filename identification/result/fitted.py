"""What a fit found: parameters with intervals, a verdict, errors, the law and the model."""

import json
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, final

import numpy as np
from numpy.typing import NDArray

from identification.data.dataset import Dataset
from identification.result.live import Live
from identification.result.outcome import Outcome, sentences
from identification.result.series import Errors
from identification.verdict.profile import Profile, profile
from symfric.foundation import packed
from symfric.foundation.files import write_text
from symfric.foundation.parameters import Parametric
from symfric.foundation.shown import Shown, Table
from symfric.model import Model
from symfric.results.stored import Format
from symfric.scenes.base import Scene

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from identification.result.page import Ranking

Array = NDArray[np.float64]


@final
@dataclass(frozen=True, eq=False, repr=False)
class Fitted(Outcome):
    """The result of a fit.

    `print(fit)` is a report of a page; `fit.to_html("out.html")` one with pictures; `fit.plot()`
    the pictures alone. `fit.save("fit.npz")` keeps all of it, data included, and `load_fit` reads
    it; a pickle does the same. A fit from JSON has neither data nor the model of a machine that is
    no `Drive`.

    Attributes:
        name: of the law or the model.
        kind: of residuals, as it was written.
        records: their names.
        parameters: name -> estimate of everything: fitted, held, start values, dead times.
        names, correlation: what was fitted, and the correlation of the estimates, shape (n, n);
            NaN where one is not determined. Start values are left out where there are many.
        undetermined: groups of parameters that the data cannot tell apart, and `directions`, the
            same in words.
        status, message: how the fit ended. Only SOLVED says that residuals are what noise leaves.
        verdict: tests of the residuals.
        errors: (record, signal) -> what is left.
        validation: the same on other data with the same parameters; None without them.
        noise: signal -> standard deviation of the noise that weighted it.
        starts: of each start, best first, how it ended.
        findings: what is doubtful about the data.
        series: signals as they are drawn.
        curve: friction over velocity; None of a model without a law.
        law: with the fitted numbers; None of a model with none or several.
        machine: the drive or scene with them; None of a law alone or a model.
        seconds, evaluations: of all starts together.
        made: versions and how it was called.
        live: its problem and its minimum; of a stored fit they are put again from `asked`.
        asked: the question and where it ended; None from JSON.
    """

    def to_pack(self) -> dict[str, Any]:
        """The fields; without the question where that holds functions that no file takes."""
        asked = self.asked if packed.holds(self.asked) else None
        return packed.state_of(self) | {"live": None, "asked": asked}

    def __copy__(self) -> "Fitted":
        """One with the same fields."""
        return packed.shallow(self)

    def __reduce__(self) -> tuple[Any, ...]:
        """A pickle holds what a file does."""
        return packed.loads, (packed.dumps(self),)

    def save(self, path: str | Path) -> None:
        """Write all of it to one file, its data, too, which `identification.load_fit` reads.

        Numbers come back to the bit. A loaded fit does all that this one does: `validate`,
        `profile` and `model` put the problem again. They cannot where it was asked with functions
        that no file takes, such as a lambda in `tied`.

        Raises:
            ValueError: the file cannot be written.
        """
        FIT.save(path, self)

    def __repr__(self) -> str:
        return f"<Fitted {self.name}: {self.status.name}>"

    def _repr_html_(self) -> str:  # pyright: ignore[reportUnusedFunction]
        """What a notebook shows: verdict, what was fitted, the pictures."""
        named = [(n, e) for n, e in self.parameters.items() if not (e.fixed or e.nuisance)]
        rows = tuple((n, *map(_told, (e.value, e.low, e.high)), e.unit) for n, e in named)
        table = Table(("parameter", "value", "95 % from", "to", "unit"), rows, (1, 2, 3))
        title = f"{self.name} fitted by {self.kind}: {self.status.name}"
        return Shown(title, tuple(sentences(self)), table).html(self.plot())

    @property
    def model(self) -> Model:
        """The model with the fitted numbers; yours keeps its parameters, which start at them.

        Raises:
            ValueError: of a fit from JSON, unless it is one of a drive.
        """
        if isinstance(self.machine, Scene):
            return self.machine.model()
        return self.alive("model").model

    def validate(self, data: Dataset) -> Errors:
        """What the fitted parameters leave of other data; start values are estimated there.

        Raises:
            ValueError: data without the signals of the fit, or a fit from JSON.
        """
        return self.alive("validate").errors_on(data)

    def profile(self, name: str, points: int = 5) -> Profile:
        """How badly the model fits with one parameter held elsewhere, see `verdict.profile`.

        Args:
            name: of a fitted parameter.
            points: about how many to each side.

        Raises:
            ValueError: a parameter that was not fitted, or a fit from JSON.
        """
        live = self.alive("profile")
        return profile(live.task, live.point, live.covariance, name, points)

    def alive(self, what: str) -> Live:
        """The problem and its minimum, for `what`.

        Raises:
            ValueError: a fit from JSON, or one that was asked with functions, from a file.
        """
        if self.live is not None:
            return self.live
        if self.asked is None:
            raise ValueError(
                f"fit of {self.name}: {what}: expected a fit of this process or of fit.save(path), "
                "got one from JSON, or one that was asked with functions, which no file takes; fit "
                "again, or use fit.values"
            )
        return self.asked.live

    def plot(self, path: str | Path | None = None, names: Sequence[str] = ()) -> "Figure":
        """Friction over velocity; data and fit, what is left and its correlation.

        Args:
            path: image file, its format taken from the ending.
            names: signals to show, of all records; the first ones if none is given.
        """
        from identification.result.picture import picture  # noqa: PLC0415  (matplotlib is slow)

        return picture(self, names, path)

    def to_html(self, path: str | Path, ranking: "Ranking | None" = None) -> None:
        """Write one HTML page with everything, self-contained: no network, no scripts.

        Args:
            path: of the page.
            ranking: of several laws, from `select`.
        """
        from identification.result.page import page_of  # noqa: PLC0415 (slow to import)

        write_text(path, page_of(self, ranking))

    def to_dataframe(self) -> Any:
        """The parameters as a pandas table: value, unit, standard error, interval, note.

        Raises:
            ImportError: no pandas.
        """
        from symfric.results import stored  # noqa: PLC0415 (slow to import)

        pandas = stored.module("to_dataframe", "pandas")
        rows = {name: vars(estimate) for name, estimate in self.parameters.items()}
        frame = pandas.DataFrame.from_dict(rows, orient="index")
        frame.index.name = "parameter"
        frame.attrs.update(name=self.name, status=self.status.name)
        return frame

    def to_dict(self) -> dict[str, Any]:
        """Everything but `live` as plain data, ready for JSON."""
        from identification.result.stored import to_dict  # noqa: PLC0415 (slow to import)

        return to_dict(self)

    def to_json(self, path: str | Path) -> None:
        """Write `to_dict` as JSON; `Fitted.from_json` reads it."""
        write_text(path, json.dumps(self.to_dict(), allow_nan=False, ensure_ascii=False))

    @staticmethod
    def from_json(path: str | Path, own: Mapping[str, type[Parametric]] | None = None) -> "Fitted":
        """The fit that `to_json` wrote, without its data.

        Args:
            path: of the file.
            own: classes of your own laws by their names; a law of an unknown class is None.

        Raises:
            ValueError: no such file, one that something else wrote, or one of a later version.
        """
        from identification.result.stored import read  # noqa: PLC0415 (slow to import)

        return read(Fitted, path, own)


FIT = Format("symfric fit", 2, "load_fit", "a saved fit", Fitted)


def load_fit(path: str | Path, own: Iterable[type | Callable[..., Any]] = ()) -> Fitted:
    """The fit that `fit.save(path)` wrote, to the bit.

    Args:
        path: the file.
        own: your classes and functions in it, such as a law of yours.

    Raises:
        ValueError: no such file, one that something else wrote, a damaged one, one of a newer
            version, or classes that are not known.
    """
    return FIT.load(path, own)


def _told(value: float | None) -> str:
    """Six digits; a dash for none."""
    return "–" if value is None else f"{value:.6g}"
