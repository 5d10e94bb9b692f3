"""Codes of phenomena, and words for the confidence in formulas."""

PHENOMENA = {
    "D": "dynamic (kinetic) friction",
    "S": "static friction (stiction or a break-away peak)",
    "St": "Stribeck effect",
    "V": "viscous friction",
    "P": "pre-sliding displacement",
    "M": "non-local memory (hysteresis loops inside loops close)",
    "L": "frictional lag",
    "B": "break-away force depends on the loading rate",
    "N": "no drift under vibration below break-away",
    "T": "static friction grows with the dwell time",
}
"""Phenomena that a law can reproduce, by the codes in `Facts.phenomena`."""

CONFIDENCE = {
    "two sources": "the formula was compared with two independent ones",
    "one source": "the formula was compared with one",
    "textbook": "the formula is in every textbook",
    "rebuilt": "the formula was lost or garbled, and rebuilt from descriptions of it",
    "constructed": "constructed here",
    "unverified": "written from memory, compared with no publication and no public code",
}
"""Confidence in a formula, by the words in `Facts.confidence`."""
