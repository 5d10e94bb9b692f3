"""Random steps of every law's guarded C under sanitizers: what dies, is silent or is altered."""

from collections.abc import Iterator

from symfric.bench.codegen_section import Cell, Goal, Section
from symfric.codegen import law_block, plant_block
from symfric.codegen.blocks.block import Block
from symfric.codegen.proof.fuzz import STEPS, Fuzzed, fuzz
from symfric.emitter.c99 import REALS
from symfric.foundation.compiler import CompileError, find_compiler
from symfric.laws import ALL_LAWS, LuGre
from symfric.scenes import Drive, Rabinowicz

TITLE = (
    "random steps under -fsanitize=undefined,address: valid ones, repaired ones, and what must not "
    "be: valid ones altered by guards, repairs without a flag, outputs that are not finite"
)
HEAD = ("block", "type", "valid", "repaired", "altered", "silent", "dead", "last")
QUICK = ("brown_mcphee", "lugre", "maxwell_slip", "haessig_friedland", "velocity_based")


def measure(quick: bool) -> Section:
    """A row for every law and type, and for two plants; `quick`: five laws, 20 000 steps."""
    compiler = find_compiler()
    if compiler is None:
        return Section(TITLE, HEAD, (), notes=("no C compiler found; install gcc or clang",))
    rows: list[list[Cell]] = []
    failed, resorts, notes = 0, 0, list[str]()
    for block, steps in _blocks(quick):
        for real in ("double", "float"):
            try:
                found = fuzz(block, real, compiler, steps=steps)
            except CompileError as error:
                return Section(TITLE, HEAD, rows, notes=(str(error),))
            rows.append(_row(found))
            failed, resorts = failed + (not found.ok), resorts + found.last_resort
            if found.report:
                notes.append(f"{found.name} in {real}: {found.report.splitlines()[0]}")
    if resorts:
        notes.append(
            f"last: {resorts} steps had no value, such as a stroke beyond the length of a damper; "
            "they gave 0 and said so"
        )
    goals = [Goal("blocks that die, are silent or altered", float(failed), 0.0)]
    return Section(TITLE, HEAD, rows, goals, notes=tuple(notes))


def _blocks(quick: bool) -> Iterator[tuple[Block, int]]:
    for name, kind in ALL_LAWS.items():
        if quick and name not in QUICK:
            continue
        try:
            yield law_block(kind()), 20_000 if quick else STEPS
        except ValueError:  # a law that has no step, see `law_block`
            continue
    if not quick:
        yield plant_block(Rabinowicz(LuGre()).model(), name="rabinowicz"), STEPS // 10
        yield plant_block(Drive(LuGre()).model(), name="drive"), STEPS // 10


def _row(found: Fuzzed) -> list[Cell]:
    counts = (found.valid, found.repaired, found.altered, found.unflagged,
              found.unfinished, found.last_resort)  # fmt: skip
    return [found.name, REALS[found.real].suffix, *map(float, counts)]
