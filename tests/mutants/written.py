"""Mutants of what is written with symbols, stored and varied: units, packs, runs, ensembles."""

from mutants.mutant import Mutant

SYMBOLIC = "symfric/foundation/symbolic.py"
T_SYMBOLIC = ("tests/symfric/foundation/test_symbolic.py",)
VARIABLE = "symfric/foundation/variable.py"
UNITS = "symfric/foundation/units.py"
T_UNITS = ("tests/symfric/foundation/test_units.py",)
IDENTITY = "symfric/foundation/identity.py"
T_IDENTITY = ("tests/symfric/foundation/test_identity.py",)
PACKED = "symfric/foundation/packed.py"
T_PACKED = ("tests/symfric/foundation/test_packed.py",)
STORED = "symfric/integrator/stored.py"
T_STORED = tuple(
    f"tests/symfric/integrator/test_stored.py::{name}"
    for name in (
        "test_what_a_file_holds_is_not_computed_again",
        "test_a_motion_without_derivative_says_so_out_of_its_file",
    )
)
FORMAT = "symfric/results/stored.py"
T_FILES = ("tests/symfric/integrator/test_stored.py::test_foreign_and_damaged_files_are_refused",)
OVER = "symfric/results/pictures.py"
T_STUDIES = ("tests/symfric/results/test_studies.py",)
MEASURED = "symfric/integrator/simulate.py"
T_MEASURED = ("tests/symfric/integrator/test_measured.py",)
RECORD = "symfric/integrator/running/record.py"
DIAGNOSIS = "symfric/integrator/running/diagnosis.py"
T_DIAGNOSIS = ("tests/symfric/integrator/running/test_diagnosis.py",)
GIVEN = "symfric/integrator/many/given.py"

WRITTEN = (
    Mutant(
        "functions of NumPy get the variable itself", SYMBOLIC,
        "return function(*map(plain, given), **named)",
        "return function(*given, **named)", T_SYMBOLIC,
    ),
    Mutant(
        "an equality stays one in equations", SYMBOLIC,
        "    if isinstance(value, Equality):\n        return ca.SX(value)\n",
        "", T_SYMBOLIC,
    ),
    Mutant(
        "a place of a part keeps its variables", SYMBOLIC,
        "    if isinstance(value, list | tuple):\n        return any(map(_stands, value))\n",
        "", T_SYMBOLIC,
    ),
    Mutant(
        "a unit that nobody knows is refused", VARIABLE,
        "size not in (None, 1.0)",
        "size not in (1.0,)", T_SYMBOLIC,
    ),
    Mutant(
        "a prefix under an unknown power is taken for SI", UNITS,
        'float("nan"))) if size[0] == 1.0 else None',
        'float("nan")))', T_UNITS,
    ),
    Mutant(
        "a bracket that nothing opens is read", UNITS,
        "if found is None or rest:",
        "if found is None:", T_UNITS,
    ),
    Mutant(
        "degrees Fahrenheit are larger than kelvins", UNITS,
        '"degF": 5 / 9',
        '"degF": 9 / 5', T_UNITS,
    ),
    Mutant(
        "half a power is a whole one", UNITS,
        "n = float(above) / float(below or 1)",
        "n = float(above)", T_UNITS,
    ),
    Mutant(
        "a year has too few seconds", UNITS,
        "365.25 * 86400.0",
        "365.25 * 8640.0", T_UNITS,
    ),
    Mutant(
        "two symbols of one name in files are one", IDENTITY,
        "if found is None or found.symbol.name() != symbol.name():",
        "if found is None:", T_IDENTITY,
    ),
    Mutant(
        "what is gone is packed again as what lies in its place", PACKED,
        "        self._alive.append(value)\n", "", T_PACKED,
    ),
    Mutant(
        "stored derivatives are found again", STORED,
        "if at is t or self.slopes is None:",
        "if self.slopes is None:", T_STORED,
    ),
    Mutant(
        "derivatives that there are none of are none", STORED,
        "raise ValueError(self.unable)",
        "return {}", T_STORED,
    ),
    Mutant(
        "times of events have derivatives that others have not", STORED,
        "            known()\n            return self.delays or {}",
        "            return self.delays or {}", T_STORED,
    ),
    Mutant(
        "stored signals are found again", STORED,
        "return dict(by_name) if at is made.t else made.evaluate(at)",
        "return made.evaluate(at)", T_STORED,
    ),
    Mutant(
        "whatever stands in a file is a run", FORMAT,
        "return checks.kind(where, found, self.content, self.what)",
        "return found", T_FILES,
    ),
    Mutant(
        "series hold the members of those before", OVER,
        "values == value)",
        "values >= value)", T_STUDIES,
    ),
    Mutant(
        "members are joined as they come", OVER,
        "    x, y = x[order], y[order]\n",
        "", T_STUDIES,
    ),
    Mutant(
        "derivatives of small numbers are rounding", MEASURED,
        "NOTHING * v.nominal / known[name].nominal",
        "NOTHING", T_MEASURED,
    ),
    Mutant(
        "a derivative that there is none of is exact", MEASURED,
        'dict.fromkeys(names, float("nan"))',
        "dict.fromkeys(names, 0.0)", T_MEASURED,
    ),
    Mutant(
        "a long run forgets how far it went", RECORD,
        "first = found[0].y0[:1] if self._before is None else self._before.reach",
        "first = found[0].y0[:1]", T_STUDIES,
    ),
    Mutant(
        "the start of a run is no extreme", RECORD,
        "ends = [first, *(p.y1 for p in found)]",
        "ends = [*(p.y1 for p in found)]", T_STUDIES,
    ),
    Mutant(
        "laws are taken for signs of a user", DIAGNOSIS,
        'if model.contacts or model.holonomic is not None:\n        return ""',
        'if False:\n        return ""', T_DIAGNOSIS,
    ),
    Mutant(
        "inputs of an ensemble have no units", GIVEN,
        'for what, group in (("x0", model.x), ("u", model.u)):',
        'for what, group in (("x0", model.x),):', T_STUDIES,
    ),
)  # fmt: skip
