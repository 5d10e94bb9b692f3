"""Command line, with one file per command; it may import all packages, and none imports it."""

from symfric.cli.app import main as main
