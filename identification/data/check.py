"""All checks of some data, one after the other."""

from collections.abc import Iterator, Mapping, Sequence

from identification.data.check_clipping import of_clipping
from identification.data.check_direction import of_direction
from identification.data.check_drift import of_dead_time, of_drift
from identification.data.check_excitation import of_excitation
from identification.data.check_frozen import of_frozen
from identification.data.check_jumps import of_jumps
from identification.data.check_motion import of_motion
from identification.data.check_points import of_points
from identification.data.check_residue import of_residue
from identification.data.check_resolution import of_resolution
from identification.data.check_spikes import of_spikes
from identification.data.check_times import of_times
from identification.data.check_units import of_units
from identification.data.check_velocity import of_velocity
from identification.data.findings import Finding, Findings
from identification.data.record import Record
from identification.data.rough import rough_model
from identification.data.view import View

HOPELESS = {"standstill", "noise", "constant", "short", "wrap", "swapped", "glitch", "frozen"}
"""Errors after which a rough model of the drive says nothing."""


def check(name: str, records: Sequence[Record], roles: Mapping[str, str]) -> Findings:
    """What is doubtful about the records, errors first.

    Args:
        name: of the data.
        records: to check.
        roles: part in the drive ("x", "v", "a", "force") -> signal, where that is called
            otherwise; only signals with a part are held against each other.
    """
    found = [f for k, one in enumerate(records) for f in _of_record(View.of(one, k, roles))]
    found.sort(key=lambda finding: finding.severity != "error")
    return Findings(tuple(found), name, tuple(one.name for one in records))


def _of_record(view: View) -> Iterator[Finding]:
    if view.record.t is None:
        yield from of_points(view)
        return
    jumps = list(of_jumps(view))
    wrapped = any(f.kind == "wrap" for f in jumps)
    spikes = [f for f in of_spikes(view) if not (wrapped and f.kind == "glitch")]
    alone = [
        *of_times(view),
        *jumps,
        *spikes,
        *of_frozen(view),
        *of_velocity(view),
        *of_motion(view, None),
    ]
    yield from alone
    hopeless = any(f.severity == "error" and f.kind in HOPELESS for f in alone)
    model = None if hopeless else rough_model(view)
    yield from of_clipping(view)
    yield from of_units(view, model)
    if model is not None:
        yield from of_direction(view, model)
        yield from (f for f in of_motion(view, model) if f.kind == "one-way")
        yield from of_excitation(view, model)
        yield from of_resolution(view, model)
        free = rough_model(view, curve=True)
        yield from of_drift(view, model, free)
        yield from of_dead_time(view, model, free)
        yield from of_residue(view, free)
