"""Which laws can show what."""

from dataclasses import fields

from symfric.laws import ALL_LAWS, PHENOMENA, POPULATIONS, AnyLaw, Law, Population, law_name
from symfric.laws.base.law import check_law


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


def require(where: str, law: AnyLaw, *codes: str) -> None:
    """Refuse a law that shows none of `codes`.

    Raises:
        ValueError: says what is missing, and names laws that have it.
    """
    check_any(where, law)
    shown = phenomena(law)
    if set(codes) & set(shown):
        return
    missing = " or ".join(PHENOMENA[code] for code in codes)
    kinds = (ALL_LAWS | POPULATIONS).items()
    able = [name for name, kind in kinds if set(codes) & set(kind.facts.phenomena)]
    raise ValueError(
        f"{where} of {law_name(law)}: expected a law that shows {missing}, got one that shows "
        f"{', '.join(PHENOMENA[code] for code in shown) or 'nothing by itself'}; "
        f"such laws are {', '.join(able)}"
    )
