"""Tests on Cortex-M cores are skipped by name where the cross compiler or QEMU is absent."""

import pytest

from symfric.embedded import Absent, find_tools

FOUND = find_tools()

on_target = pytest.mark.skipif(
    isinstance(FOUND, Absent), reason=FOUND.advice if isinstance(FOUND, Absent) else ""
)
