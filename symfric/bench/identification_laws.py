"""Every static law on the record of EMPS: it fits, or one sentence refuses it.

Each law of the catalogue without states is fitted by inverse dynamics, as it is and with its own
parameters for either direction. A law fits if its fit ends at a minimum that it stays at: status
SOLVED or DOUBTFUL. The records have no licence and are no part of the package.
"""

from collections.abc import Iterator
from pathlib import Path
from time import process_time

from identification.data.dataset import Dataset
from identification.fit import Fit
from identification.residuals.inverse import InverseDynamics
from symfric.bench.identification import Row
from symfric.foundation.status import Status
from symfric.laws import law_from_text
from symfric.laws.catalogue import ALL_LAWS

CASE = "laws"
EMPS = Path(__file__).parents[3] / "shared" / "data" / "EMPS" / "DATA_EMPS.mat"
BEST = "asymmetric(andersson)"
ENDED = (Status.SOLVED, Status.DOUBTFUL)


def measure(quick: bool) -> Iterator[Row]:
    """The rows; `quick` takes every fourth law."""
    if not EMPS.is_file():
        note = "data absent (../shared/data/EMPS)"
        yield Row(CASE, "laws that neither fit nor are refused", float("nan"), 0.0, "<=", 0.0, note)
        return
    data, begun = Dataset.read(EMPS), process_time()
    names = [n for n in static_laws() for n in (n, f"asymmetric({n})")][:: 4 if quick else 1]
    outcomes = {name: outcome(name, data) for name in names}
    seconds = process_time() - begun
    lost = [name for name, text in outcomes.items() if text not in ("fits", "refused")]
    note = f"of {len(names)}; refused: {sum(t == 'refused' for t in outcomes.values())}"
    note += "".join(f"; {name}: {outcomes[name]}" for name in lost)
    what = "laws that neither fit nor are refused"
    yield Row(CASE, what, float(len(lost)), 0.0, "<=", seconds, note)
    begun = process_time()
    best = Fit(InverseDynamics(), BEST, data).solve(throw=False)
    (error,) = best.errors.values()
    took = process_time() - begun
    yield Row(CASE, f"force error of {BEST} [%]", error.relative, 3.0, "<=", took)


def static_laws() -> list[str]:
    """Names of the laws without states that a text makes."""
    return [name for name in ALL_LAWS if not law_from_text(name).states]


def outcome(name: str, data: Dataset) -> str:
    """What becomes of a law: "fits", "refused", or what went wrong."""
    try:
        found = Fit(InverseDynamics(), name, data).solve(throw=False)
    except ValueError as error:
        return "refused" if "\n" not in str(error) else f"{error}"
    return "fits" if found.status in ENDED else f"{found.status.name}: {found.message}"
