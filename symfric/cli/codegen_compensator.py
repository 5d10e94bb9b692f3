"""`symfric codegen --compensator`: what the options mean."""

from collections.abc import Sequence
from dataclasses import fields, replace

from symfric.codegen import Block
from symfric.compensation import Compensation, compensator, settings_from_text
from symfric.laws import AnyLaw, Law
from symfric.scenes import Drive

FLAG = "--compensator"
SETTINGS = tuple(item.name for item in fields(Compensation))
"""What can be said about a compensator, for the help."""


def compensator_block(
    law: AnyLaw,
    drive: Drive | None,
    texts: Sequence[str],
    *,
    name: str | None,
    h: float | None,
    turning: bool,
    fold: bool,
) -> Block:
    """The compensator of a law, with the load and the offset of the drive that it was fitted in.

    Args:
        law: with its numbers.
        drive: that of a fit.
        texts: settings, NAME=VALUE each, see `settings_from_text`.

    Raises:
        ValueError: a population; as `compensator`.
    """
    if not isinstance(law, Law):
        raise ValueError(f"{FLAG}: expected a law, got a population, whose force is random")
    subject = law if drive is None else replace(drive, law=law)
    settings = settings_from_text(texts)
    return compensator(subject, settings=settings, name=name, h=h, turning=turning, fold=fold)
