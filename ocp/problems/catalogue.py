"""All ready problems."""

from ocp.problems.friction import FRICTION
from ocp.problems.others import OTHERS
from ocp.problems.ready import Ready, by_name

READY: dict[str, Ready] = by_name(*FRICTION, *OTHERS)
"""Name -> problem."""
