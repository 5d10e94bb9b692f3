"""Compilers that the tests of generated C run with; a test is skipped where one is missing."""

import shutil

import pytest

from symfric.foundation.programs import Compiler, find_compiler


@pytest.fixture(scope="session")
def compiler() -> Compiler:
    found = find_compiler()
    if found is None:
        pytest.skip("no C compiler on this machine")
    return found


@pytest.fixture(scope="session", params=["gcc", pytest.param("clang", marks=pytest.mark.slow)])
def each_compiler(request: pytest.FixtureRequest) -> str:
    if shutil.which(request.param) is None:
        pytest.skip(f"no {request.param} on this machine")
    return request.param
