"""Class `Fitted`: parameters with intervals, verdict, errors, law and model of a fit."""

import json
from collections.abc import Callable, Iterable, Mapping, Sequence
from concurrent.futures import Executor
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, final

from identification.data.dataset import Dataset
from identification.result.outcome import FitFields, sentences
from identification.result.parts import Errors, Live
from identification.verdict.bootstrap import Bootstrap, bootstrap
from identification.verdict.profile import Profile, profile
from symfric.foundation import packed
from symfric.foundation.files import write_text
from symfric.foundation.parameters import Parametric
from symfric.foundation.shown import Shown, TextTable
from symfric.model import Model
from symfric.results.stored import Format
from symfric.scenes.base import Scene

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from identification.result.page import ShownRanking


@final
@dataclass(frozen=True, eq=False, repr=False)
class Fitted(packed.Portable, FitFields):
    """Result of a fit.

    `print(fit)` prints a one-page report, `fit.to_html("out.html")` writes a report with figures,
    and `fit.plot()` returns the figures. `fit.save("fit.npz")` stores everything including the
    data; `load_fit` reads the file. A pickle has the same content. A fit from JSON has neither data
    nor the model of a machine other than a `Drive`.

    Attributes:
        name: name of the law or the model.
        kind: Python code of the residuals.
        records: names of the records.
        parameters: name -> estimate of a fitted or held parameter, a start value or a dead time.
        names, correlation: fitted values, and the correlation of their estimates, shape (n, n);
            NaN where undetermined. Start values are left out if there are many.
        undetermined: groups of parameters that the data do not separate.
        directions: messages on parameters that are not or poorly identifiable.
        status, message: end of the fit. Only SOLVED means that the residuals are noise.
        verdict: tests of the residuals.
        errors: (record, signal) -> size of the residuals.
        validation: the same for other data with the same parameters; None without other data.
        noise: signal -> standard deviation of the noise that weights it.
        starts: ends of the starts, best first.
        findings: warnings on the data.
        series: signals for plots.
        curve: friction over velocity; None for a model without a law.
        law: law with the fitted numbers; None for a model with no law or several.
        machine: drive or scene with the fitted numbers; None for a law alone or a model.
        seconds, evaluations: totals of all starts.
        made: versions and the call.
        live: problem and minimum; a stored fit restores them from `asked`.
        asked: arguments of the fit and its end; None from JSON.
        sides: values in the units of the drive of the data; () without a drive.
    """

    def to_pack(self) -> dict[str, Any]:
        """Return the fields, without `asked` if it holds functions that a file cannot store."""
        asked = self.asked if packed.holds(self.asked) else None
        return packed.state_of(self) | {"live": None, "asked": asked}

    def save(self, path: str | Path) -> None:
        """Write the fit with its data to one file, which `identification.load_fit` reads.

        Numbers are stored exactly. A loaded fit has all functions of this one: `validate`,
        `profile` and `model` restore the problem. They cannot if the fit was called with functions
        that a file cannot store, such as a lambda in `tied`.

        Raises:
            ValueError: the file cannot be written.
        """
        FIT.save(path, self)

    def __repr__(self) -> str:
        return f"<Fitted {self.name}: {self.status.name}>"

    def _repr_html_(self) -> str:  # pyright: ignore[reportUnusedFunction]
        """Return the notebook view with verdict, fitted values and figures."""
        named = [(n, e) for n, e in self.parameters.items() if not (e.fixed or e.nuisance)]
        rows = tuple(
            (n, *("–" if x is None else f"{x:.6g}" for x in (e.value, e.low, e.high)), e.unit)
            for n, e in named
        )
        table = TextTable(("parameter", "value", "95 % from", "to", "unit"), rows, (1, 2, 3))
        title = f"{self.name} fitted by {self.kind}: {self.status.name}"
        return Shown(title, tuple(sentences(self)), table).html(self.plot())

    @property
    def model(self) -> Model:
        """Model with the fitted numbers; a model of the user keeps its parameters, starting there.

        Raises:
            ValueError: the fit is from JSON and not one of a drive.
        """
        if isinstance(self.machine, Scene):
            return self.machine.model()
        return self.alive("model").closed.model

    def validate(self, data: Dataset) -> Errors:
        """Return the errors on other data with these parameters; start values are estimated there.

        Raises:
            ValueError: the data lack the signals of the fit, or the fit is from JSON.
        """
        return self.alive("validate").errors_on(data)

    def profile(self, name: str, points: int = 5) -> Profile:
        """Return the profile likelihood of one parameter; see `verdict.profile`.

        Args:
            name: name of a fitted parameter.
            points: approximate number of points to each side.

        Raises:
            ValueError: the parameter was not fitted, or the fit is from JSON.
        """
        live = self.alive("profile")
        return profile(live.task, live.point, live.covariance, name, points)

    def bootstrap(
        self, count: int = 200, seed: int = 0, executor: Executor | None = None
    ) -> Bootstrap:
        """Fit data with resampled residuals; see `verdict.bootstrap`.

        Args:
            count: number of data sets; 200 for standard errors, 1000 or more for intervals.
            seed: random seed.
            executor: executor of `concurrent.futures`; the result is bit-identical.

        Raises:
            ValueError: invalid arguments, or the fit is from JSON.
        """
        live = self.alive("bootstrap")
        return bootstrap(live.task, live.point, self.verdict.effective, count, seed, executor)

    def alive(self, what: str) -> Live:
        """Return the problem and its minimum; `what` names the operation in messages.

        Raises:
            ValueError: the fit is from JSON, or was stored and had been called with functions.
        """
        if self.live is not None:
            return self.live
        if self.asked is None:
            raise ValueError(
                f"fit of {self.name}: {what}: expected a fit of this process or of fit.save(path), "
                "got one from JSON, or one called with functions, which a file cannot store; fit "
                "again, or use fit.values"
            )
        return self.asked.live

    def plot(self, path: str | Path | None = None, names: Sequence[str] = ()) -> "Figure":
        """Plot friction over velocity, data and fit, and residuals with their autocorrelation.

        Args:
            path: image file to write; its extension selects the format.
            names: signals to show, of all records; none: the first signals.
        """
        from identification.result.picture import picture  # noqa: PLC0415  (matplotlib is slow)

        return picture(self, names, path)

    def to_html(self, path: str | Path, ranking: "ShownRanking | None" = None) -> None:
        """Write one self-contained HTML page with all results, without network or scripts.

        Args:
            path: file to write.
            ranking: ranking of several laws by `select`.
        """
        from identification.result.page import page_of  # noqa: PLC0415 (slow to import)

        write_text(path, page_of(self, ranking))

    def to_dataframe(self) -> Any:
        """Return the parameters as a pandas table: value, unit, standard error, interval, note.

        Raises:
            ImportError: pandas is not installed.
        """
        from symfric.results import stored  # noqa: PLC0415 (slow to import)

        pandas = stored.module("to_dataframe", "pandas")
        rows = {name: vars(estimate) for name, estimate in self.parameters.items()}
        frame = pandas.DataFrame.from_dict(rows, orient="index")
        frame.index.name = "parameter"
        frame.attrs.update(name=self.name, status=self.status.name)
        return frame

    def to_dict(self) -> dict[str, Any]:
        """Return all fields except `live` as plain data for JSON."""
        from identification.result.stored import to_dict  # noqa: PLC0415 (slow to import)

        return to_dict(self)

    def to_json(self, path: str | Path) -> None:
        """Write `to_dict` as JSON; `Fitted.from_json` reads it."""
        write_text(path, json.dumps(self.to_dict(), allow_nan=False, ensure_ascii=False))

    @staticmethod
    def from_json(path: str | Path, own: Mapping[str, type[Parametric]] | None = None) -> "Fitted":
        """Read a fit written by `to_json`; it has no data.

        Args:
            path: file to read.
            own: classes of user-defined laws by name; a law of an unknown class is None.

        Raises:
            ValueError: no such file, another file format, or a later version.
        """
        from identification.result.stored import read  # noqa: PLC0415 (slow to import)

        return read(Fitted, path, own)


FIT = Format("symfric fit", 2, "load_fit", "a saved fit", Fitted)


def load_fit(path: str | Path, own: Iterable[type | Callable[..., Any]] = ()) -> Fitted:
    """Read a fit written by `fit.save(path)`, exactly.

    Args:
        path: file to read.
        own: user-defined classes and functions in the file, such as a law.

    Raises:
        ValueError: no such file, another file format, a damaged file, a newer version, or
            unknown classes.
    """
    return FIT.load(path, own)
