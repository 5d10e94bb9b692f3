"""All ready problems."""

from ocp.problems.friction import FRICTION
from ocp.problems.ready import Ready, by_name

READY: dict[str, Ready] = by_name(*FRICTION)
"""Name -> problem; rooms add theirs here: `by_name(*FRICTION, *OTHERS)`."""
