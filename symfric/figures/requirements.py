"""Which laws can show what."""

from dataclasses import fields

from symfric.laws import ALL_LAWS, PHENOMENA, Law, law_name
from symfric.laws.base import check_law


def parts(law: Law) -> list[type[Law]]:
    """The kinds of law inside `law`, from the outside in, each once."""
    found = [type(law)]
    for item in fields(law):
        value = getattr(law, item.name)
        for child in value if isinstance(value, tuple) else (value,):
            if isinstance(child, Law):
                found += parts(child)
    return list(dict.fromkeys(found))


def phenomena(law: Law) -> list[str]:
    """The codes of everything that `law` and the laws in it show."""
    shown = {code for part in parts(law) for code in part.facts.phenomena}
    return [code for code in PHENOMENA if code in shown]


def require(where: str, law: Law, *codes: str) -> None:
    """Refuse a law that shows none of `codes`.

    Raises:
        ValueError: says what is missing, and names laws that have it.
    """
    check_law(where, law)
    shown = phenomena(law)
    if set(codes) & set(shown):
        return
    missing = " or ".join(PHENOMENA[code] for code in codes)
    able = [name for name, kind in ALL_LAWS.items() if set(codes) & set(kind.facts.phenomena)]
    raise ValueError(
        f"{where} of {law_name(law)}: expected a law that shows {missing}, got one that shows "
        f"{', '.join(PHENOMENA[code] for code in shown) or 'nothing by itself'}; "
        f"such laws are {', '.join(able)}"
    )
