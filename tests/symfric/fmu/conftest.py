"""Units of these tests are compiled without optimisation: the same bits in half the time."""

from collections.abc import Iterator

import pytest

from symfric.fmu import package


@pytest.fixture(scope="session", autouse=True)
def quickly_compiled() -> Iterator[None]:
    with pytest.MonkeyPatch.context() as patch:
        flags = tuple("-O0" if flag == "-O2" else flag for flag in package.FLAGS)
        patch.setattr(package, "FLAGS", flags)
        yield
