"""Catalogue of laws by name, and the conversion between laws and text."""

from collections.abc import Callable
from re import fullmatch, sub

from symfric.foundation import checks
from symfric.foundation.parameters import check_names
from symfric.laws.base.families import Exact
from symfric.laws.base.law import Law, require_law
from symfric.laws.composed.compose import Asymmetric, LoadDependent, Sum
from symfric.laws.composed.populations import AnyLaw, GenericAsperity, Population, RandomBristles
from symfric.laws.composed.wrap import Lagged, LoadNormalised, TemperatureDependent
from symfric.laws.dynamic import dahl, dwell, lugre, maxwell_slip, stick_slip
from symfric.laws.static import (
    applied_force,
    coulomb,
    exponential,
    from_data,
    machines,
    piecewise,
    self_tuning,
    smooth_peak,
)

STATIC_LAWS: dict[str, type[Law]] = {
    "coulomb": coulomb.Coulomb,
    "viscous": coulomb.Viscous,
    "power_law_viscous": coulomb.PowerLawViscous,
    "stribeck": exponential.Stribeck,
    "tustin": exponential.Tustin,
    "lorentzian": smooth_peak.Lorentzian,
    "steady_state_lugre": exponential.SteadyStateLuGre,
    "brown_mcphee": smooth_peak.BrownMcPhee,
    "simscape_breakaway": smooth_peak.SimscapeBreakaway,
    "specker": smooth_peak.Specker,
    "self_tuning": self_tuning.SelfTuning,
    "brittle_self_tuning": self_tuning.BrittleSelfTuning,
    "rui_wang": self_tuning.RuiWang,
    "threlfall": piecewise.Threlfall,
    "modified_threlfall": piecewise.ModifiedThrelfall,
    "bengisu_akay": piecewise.BengisuAkay,
    "velocity_based": piecewise.VelocityBased,
    "ambrosio": piecewise.Ambrosio,
    "hollars": piecewise.Hollars,
    "exudyn": piecewise.Exudyn,
    "step5": piecewise.Step5,
    "benson": exponential.Benson,
    "andersson": exponential.Andersson,
    "duan_singh": exponential.DuanSingh,
    "berger": exponential.Berger,
    "popp_stelter": smooth_peak.PoppStelter,
    "makkar_dixon": smooth_peak.MakkarDixon,
    "karnopp": applied_force.Karnopp,
    "awrejcewicz": applied_force.Awrejcewicz,
    "leine_switch": applied_force.LeineSwitch,
    "wojewoda": applied_force.Wojewoda,
    "quarter_car_general": machines.QuarterCarGeneral,
    "quarter_car_simple": machines.QuarterCarSimple,
    "bittencourt": machines.Bittencourt,
    "bam": machines.BAM,
    "capstan": machines.Capstan,
    "brush_tyre": machines.BrushTyre,
    "mixed_lubrication": smooth_peak.MixedLubrication,
    "spline": from_data.Spline,
    "network": from_data.Network,
}
"""Memoryless laws by name, with the most widely used laws first."""

DYNAMIC_LAWS: dict[str, type[Law]] = {
    "dahl": dahl.Dahl,
    "bliman_sorine": dahl.BlimanSorine,
    "haessig_friedland": stick_slip.HaessigFriedland,
    "lugre": lugre.LuGre,
    "lugre_normalised": lugre.LuGreNormalised,
    "lugre_passive": lugre.LuGrePassive,
    "lugre_tyre": lugre.LuGreTyre,
    "elasto_plastic": lugre.ElastoPlastic,
    "leuven": maxwell_slip.Leuven,
    "maxwell_slip": maxwell_slip.MaxwellSlip,
    "gms": maxwell_slip.GMS,
    "stick_slip": stick_slip.StickSlip,
    "gonthier": dwell.Gonthier,
    "bristle_2d": stick_slip.Bristle2D,
    "bouc_wen": dahl.BoucWen,
    "rate_and_state": dwell.RateAndState,
    "armstrong": dwell.Armstrong,
    "exact_coulomb": stick_slip.ExactCoulomb,
}
"""Laws with states by name."""

ALL_LAWS = STATIC_LAWS | DYNAMIC_LAWS
"""Laws by name; the contract tests cover every entry."""


POPULATIONS: dict[str, type[GenericAsperity | RandomBristles]] = {
    "generic_asperity": GenericAsperity,
    "random_bristles": RandomBristles,
}
"""Populations of random contacts by name: reference models with figures and a force history."""

ALIASES = {
    "bo_pavelescu": "stribeck",
    "adams": "velocity_based",
    "smooth_coulomb": "coulomb",
    "leine": "leine_switch",
    "simscape": "simscape_breakaway",
    "hersey": "mixed_lubrication",
    "seven_parameter": "armstrong",
    "iwan": "maxwell_slip",
    "reset_integrator": "haessig_friedland",
    "set_valued_coulomb": "exact_coulomb",
    "dieterich_ruina": "rate_and_state",
    "haessig_friedland_bristles": "random_bristles",
}
"""Other names of laws that papers and programs use."""

Wrapping = Asymmetric | Exact | LoadDependent | LoadNormalised | Lagged | TemperatureDependent
WRAPPERS: dict[str, type[Wrapping]] = {
    "asymmetric": Asymmetric,
    "exact": Exact,
    "load_dependent": LoadDependent,
    "load_normalised": LoadNormalised,
    "lagged": Lagged,
    "temperature_dependent": TemperatureDependent,
}
"""Wrappers of a single law, by the name that precedes the parentheses in a text."""
NAMES: dict[type, str] = {kind: name for name, kind in (ALL_LAWS | POPULATIONS | WRAPPERS).items()}

DEEPEST = 20
"""Largest nesting depth of laws in a text; deeper texts would exhaust the stack."""


def law_name(law: AnyLaw) -> str:
    """Return the text from which `any_from_text` creates the law; the class name if unknown."""
    if not isinstance(law, Law | Population):  # pyright: ignore[reportUnnecessaryIsInstance]
        require_law("law_name", law)
    if isinstance(law, Sum):
        return "+".join(law_name(term) for term in law.laws)
    name = NAMES.get(type(law), type(law).__name__)
    return f"{name}({law_name(law.inner)})" if isinstance(law, Wrapping) else name


Find = Callable[[str], Law]
"""Function that returns the law of a term FILE.py:NAME."""


def any_from_text(text: str, find: Find | None = None) -> AnyLaw:
    """Return the law or population given by `text`, with default parameters.

    See `law_from_text`, also for errors.
    """
    checks.text("law", text, "the name of a law, such as lugre")
    name = ALIASES.get(text.strip(), text.strip())
    return POPULATIONS[name]() if name in POPULATIONS else law_from_text(text, find)


def law_from_text(text: str, find: Find | None = None) -> Law:
    """Return the law given by `text`, with default parameters.

    The text is a name such as `brown_mcphee`, an alias such as `adams`, a sum such as
    `coulomb+viscous`, or a wrapped law: `asymmetric(coulomb+viscous)`, `exact(stribeck)`,
    `load_dependent(lugre)`, `load_normalised(lugre)`, `lagged(stribeck)` or
    `temperature_dependent(lugre)`.

    Args:
        text: the text.
        find: function that returns the law of a term such as `my_laws.py:Falling`; None: no law of
            a file, so that a text never runs code.

    Raises:
        ValueError: unknown name (the message suggests the closest), empty term, unbalanced
            parentheses.
    """
    checks.text("law", text, "the name of a law, such as lugre")
    terms = _split_terms(text)
    laws = tuple(_single(term, text, find) for term in terms)
    return laws[0] if len(laws) == 1 else Sum(laws)


def _single(term: str, text: str, find: Find | None) -> Law:
    if wrapped := fullmatch(rf"({'|'.join(WRAPPERS)})\((.+)\)", term):
        kind, inner = WRAPPERS[wrapped[1]], law_from_text(wrapped[2], find)
        return Asymmetric(inner, inner) if issubclass(kind, Asymmetric) else kind(inner)
    if ".py" in term:
        if find is None:
            raise ValueError(f"law '{text}': expected a name, got a file; import the law from it")
        return find(term)
    name = ALIASES.get(term, term)
    if name in POPULATIONS:
        raise ValueError(
            f"law '{text}': expected a law with equations, got {name}, a population of random "
            "contacts; it has figures and `force(t, x, N)`; the most similar law is gms"
        )
    if name in WRAPPERS:
        raise ValueError(f"law '{text}': expected a law to wrap, as in {name}(stribeck), got none")
    check_names(f"law {checks.shown(text)}", [name], ALL_LAWS, "`symfric laws` lists them")
    return ALL_LAWS[name]()


def _split_terms(text: str) -> list[str]:
    """Split `text` at the plus signs outside parentheses."""
    where = f"law {checks.shown(text)}"
    terms, depth = [""], 0
    for letter in sub(r"\s*([()+])\s*", r"\1", text.strip()):
        depth += (letter == "(") - (letter == ")")
        if depth < 0:
            break
        if depth > DEEPEST:
            raise ValueError(f"{where}: expected at most {DEEPEST} nested laws, got more")
        if letter == "+" and depth == 0:
            terms.append("")
        else:
            terms[-1] += letter
    if depth != 0:
        raise ValueError(f"{where}: expected balanced parentheses, got {abs(depth)} too many")
    if not all(terms):
        raise ValueError(
            f"{where}: expected the name of a law, got an empty term; "
            "write one as in coulomb+viscous"
        )
    return terms
