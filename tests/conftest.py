"""Settings of the whole test suite."""

import matplotlib as mpl
import pytest
from hypothesis import settings

mpl.use("Agg")
settings.register_profile("symfric", derandomize=True, deadline=None, max_examples=50)
settings.load_profile("symfric")


def pytest_addoption(parser: pytest.Parser) -> None:
    parser.addoption(
        "--update-golden", action="store_true", help="write tables under tests/golden anew"
    )
