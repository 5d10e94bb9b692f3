"""Compilers that the tests of generated C run with; a test is skipped where one is missing."""

from collections.abc import Iterator

import pytest

from symfric.codegen import verification
from symfric.foundation.programs import Compiler, find_compiler


@pytest.fixture(scope="module", autouse=True)
def fewer_steps_verified() -> Iterator[None]:
    """Verify generated C over 50 stretches of inputs; CasADi's share of 200 costs seconds."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(verification, "STEPS", 5000)
        patch.setattr(verification, "FEWER", 1000)
        yield


@pytest.fixture(scope="session")
def compiler() -> Compiler:
    found = find_compiler()
    if found is None:
        pytest.skip("no C compiler on this machine")
    return found
