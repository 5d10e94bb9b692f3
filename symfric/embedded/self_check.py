"""The unit test of a kit, run where it is meant to run."""

from collections.abc import Sequence
from pathlib import Path
from tempfile import TemporaryDirectory

from symfric.codegen.generated import Generated
from symfric.codegen.layout import prefix
from symfric.embedded.cores import CORES
from symfric.embedded.firmware import TEST
from symfric.embedded.qemu import Target
from symfric.embedded.tools import Absent, Tools, find_tools
from symfric.emitter.c99 import REALS
from symfric.foundation import checks
from symfric.foundation.compiler import CompileError


def wrong_on_target(
    generated: Generated,
    real: str = "float",
    core: str = "m4f",
    *,
    flags: Sequence[str] = ("-O2",),
    tools: Tools | Absent | None = None,
) -> int:
    """How many results of the kit's own unit test are wrong on a core under QEMU.

    Args:
        generated: what `generate` returned, with the floating point type `real`.
        core: one of `CORES`.
        flags: of the compiler.
        tools: what `find_tools` found.

    Raises:
        ValueError: an unknown core, a type that was not generated.
        CompileError: tools are absent, the compiler refuses the code, or the program fails.
    """
    where = "embedded"
    checks.kind(where, generated, Generated, "what generate(...) returned")
    checks.choice(f"{where}: real", real, generated.reals)
    checks.choice(f"{where}: core", core, CORES)
    found = find_tools() if tools is None else tools
    if isinstance(found, Absent):
        raise CompileError(f"{where}: {found.advice}")
    name = prefix(generated.block, REALS[real])
    sources = [generated.folder / f"{name}{ending}.c" for ending in ("", "_test")]
    target = Target(CORES[core], found, flags)
    with TemporaryDirectory(prefix="symfric-") as folder:
        own = (f"-D{name.upper()}_TEST_NO_MAIN", f"-I{generated.folder}")
        image = target.linked(Path(folder), TEST.substitute(name=name), sources, *own)
        return int(target.heard(image)["wrong"][0])
