"""Which laws can show what."""

from dataclasses import fields

import numpy as np
from numpy.typing import NDArray

from symfric.laws import ALL_LAWS, PHENOMENA, POPULATIONS, AnyLaw, Law, Population, law_name
from symfric.laws.base.law import check_law

Array = NDArray[np.float64]
GIVEN = ("v", "N", "F_e", "dv")
"""What a block that is slid or pushed offers a law."""


def parts(law: AnyLaw) -> list[type[AnyLaw]]:
    """The kinds of law inside `law`, from the outside in, each once."""
    found: list[type[AnyLaw]] = [type(law)]
    for item in fields(law):
        value = getattr(law, item.name)
        for child in value if isinstance(value, tuple) else (value,):
            if isinstance(child, Law):
                found += parts(child)
    return list(dict.fromkeys(found))


def phenomena(law: AnyLaw) -> list[str]:
    """The codes of everything that `law` and the laws in it show."""
    shown = {code for part in parts(law) for code in part.facts.phenomena}
    return [code for code in PHENOMENA if code in shown]


def check_any(where: str, law: object) -> None:
    """Refuse what is neither a law nor a population of contacts."""
    if not isinstance(law, Population):
        check_law(where, law)


def finite(where: str, law: AnyLaw, F: Array) -> Array:
    """`F` [N] of a law, if any of it is a number.

    Raises:
        ValueError: none is, as where parameters leave the range of a root or an arcsine.
    """
    if F.size and not np.isfinite(F).any():
        raise ValueError(
            f"{where} of {law_name(law)}: expected parameters under which the force is a number, "
            "got some under which it is none anywhere; the limits of the law say which"
        )
    return F


def require(where: str, law: AnyLaw, *codes: str) -> None:
    """Refuse a law that shows none of `codes`, or needs more than motion and force of a block.

    Raises:
        ValueError: says what is missing, and names laws that have it; what else the law needs.
    """
    check_any(where, law)
    shown = phenomena(law)
    needed = [i.name for i in law.inputs if i.name not in GIVEN] if isinstance(law, Law) else []
    if set(codes) & set(shown) and not needed:
        return
    if set(codes) & set(shown):
        raise ValueError(
            f"{where} of {law_name(law)}: expected a law that needs no more than velocity, load, "
            f"acceleration and applied force, got one that needs {', '.join(needed)}; a figure of "
            "a scene that has them shows it, see `symfric scenes`"
        )
    missing = " or ".join(PHENOMENA[code] for code in codes)
    kinds = (ALL_LAWS | POPULATIONS).items()
    able = [name for name, kind in kinds if set(codes) & set(kind.facts.phenomena)]
    raise ValueError(
        f"{where} of {law_name(law)}: expected a law that shows {missing}, got one that shows "
        f"{', '.join(PHENOMENA[code] for code in shown) or 'nothing by itself'}; "
        f"such laws are {', '.join(able)}"
    )
