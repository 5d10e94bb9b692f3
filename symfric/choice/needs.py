"""What a user may need of a law, in plain words, and the codes by which laws say so."""

from collections.abc import Iterable

from symfric.foundation import checks

NEEDS = {
    "sliding": ("D", "kinetic friction"),
    "stiction": ("S", "static friction or a peak at break-away"),
    "stribeck": ("St", "friction falls as sliding begins"),
    "viscous": ("V", "friction grows with the velocity"),
    "presliding": ("P", "elastic displacement before break-away"),
    "memory": ("M", "hysteresis loops close inside each other"),
    "lag": ("L", "friction follows the velocity late"),
    "loading-rate": ("B", "break-away depends on how fast the load grows"),
    "drift-free": ("N", "no creep under vibration below break-away"),
    "dwell": ("T", "static friction grows with the time at rest"),
}
"""Word -> code of `symfric.laws.PHENOMENA`, and what it means."""

ALIASES = {
    "static": "stiction",
    "static-friction": "stiction",
    "break-away": "stiction",
    "dynamic": "sliding",
    "kinetic": "sliding",
    "pre-sliding": "presliding",
    "hysteresis": "memory",
    "frictional-lag": "lag",
    "no-drift": "drift-free",
    "ageing": "dwell",
}
"""Other words for the same, as papers use them."""


def needed(where: str, given: object) -> tuple[str, ...]:
    """The words of `NEEDS` that `given` means: words, aliases or codes, in this order.

    Raises:
        ValueError: a text instead of a sequence, or a word that means nothing; it lists all.
    """
    of_code = {code: word for word, (code, _) in NEEDS.items()}
    asked = checks.names(where, given)
    words = [_word(text, of_code) for text in asked]
    unknown = [text for text, word in zip(asked, words, strict=True) if word not in NEEDS]
    if unknown:
        raise ValueError(f"{where}: expected some of {', '.join(NEEDS)}, got {', '.join(unknown)}")
    return tuple(word for word in NEEDS if word in words)


def _word(text: str, of_code: dict[str, str]) -> str:
    plain = text.strip().lower().replace("_", "-").replace(" ", "-")
    return of_code.get(text.strip(), ALIASES.get(plain, plain))


def lacking(needs: Iterable[str], codes: Iterable[str]) -> list[str]:
    """Those of the words `needs` that a law with these phenomena does not show."""
    shown = set(codes)
    return [word for word in needs if NEEDS[word][0] not in shown]
