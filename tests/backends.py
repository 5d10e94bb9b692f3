"""Where a test runs: in CasADi's virtual machine, as machine code, or in both."""

import pytest

from symfric.foundation.programs import find_compiler

BACKENDS = ["vm"] + ["compiled"] * (find_compiler() is not None)
"""Those that run here."""

needs_compiler = pytest.mark.skipif(len(BACKENDS) < 2, reason="needs a C compiler")
each_backend = pytest.mark.parametrize(
    "backend", ["vm", pytest.param("compiled", marks=needs_compiler)]
)
