"""Settings of the whole test suite."""

import gc
import os
import signal
import sys
from collections.abc import Iterator
from zlib import crc32

import matplotlib as mpl
import pytest
import stored
from hypothesis import settings

mpl.use("Agg")
settings.register_profile("symfric", derandomize=True, deadline=None, max_examples=12)
settings.register_profile("stress", derandomize=True, deadline=None, max_examples=300)
settings.load_profile("symfric")  # `--hypothesis-profile stress`: see `make stress`


def pytest_addoption(parser: pytest.Parser) -> None:
    parser.addoption(
        "--update-golden", action="store_true", help="write tables under tests/golden anew"
    )
    parser.addoption(
        "--recompute", action="store_true", help="compute stored references again and compare"
    )
    parser.addoption("--share", metavar="K/N", help="mark share K of N shares of the tests as due")


def pytest_configure(config: pytest.Config) -> None:
    gc.disable()  # collecting the tests leaves no garbage; searching it took a quarter of the time
    # Workers and the programs that tests start read compiled sources, also where nobody keeps them.
    sys.dont_write_bytecode = False
    os.environ.pop("PYTHONDONTWRITEBYTECODE", None)
    stored.chosen["update"] = config.getoption("--update-golden")
    stored.chosen["recompute"] = config.getoption("--recompute")
    # A shell lets its background jobs ignore SIGINT, which the tests of Ctrl-C raise.
    if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
        signal.signal(signal.SIGINT, signal.default_int_handler)


@pytest.hookimpl(tryfirst=True)  # before -m selects
def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    if config.getoption("--share"):
        k, n = map(int, config.getoption("--share").split("/"))
        for item in items:
            if crc32(item.nodeid.encode()) % n == k:
                item.add_marker("due")


def pytest_collection_finish() -> None:
    gc.freeze()
    gc.set_threshold(20_000)  # tests make little garbage
    gc.enable()


@pytest.fixture(autouse=True)
def pictures_are_closed() -> Iterator[None]:
    """Figures are made outside pyplot, which would keep them: whatever a test has drawn."""
    yield
    if "matplotlib.pyplot" in sys.modules:
        kept = sys.modules["matplotlib.pyplot"].get_fignums()
        sys.modules["matplotlib.pyplot"].close("all")
        assert not kept, "a figure of pyplot was left open"
