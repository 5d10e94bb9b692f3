"""The command line: one file per command; knows all packages, and nothing knows it."""

from symfric.cli.app import main as main
