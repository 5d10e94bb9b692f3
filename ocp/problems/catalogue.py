"""All ready problems."""

from ocp.problems.ready import Ready, by_name

READY: dict[str, Ready] = by_name()
"""Name -> problem; rooms add theirs here: `by_name(*FRICTION, *OTHERS)`."""
