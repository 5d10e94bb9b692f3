"""Mutants of what is told: runs, what shows itself, the gallery, the command line, the pages."""

from mutants.mutant import Mutant

FOUNDATION = "symfric/foundation/"
RESULTS = "symfric/results/"
GALLERY = "symfric/gallery/"
CLI = "symfric/cli/"
PAGES = "docs/machine/"


def foundation(name: str) -> tuple[str, ...]:
    """Tests of the foundation."""
    return (f"tests/symfric/foundation/test_{name}.py",)


def results(name: str) -> tuple[str, ...]:
    """Tests of results."""
    return (f"tests/symfric/results/test_{name}.py",)


T_RENDERING = ("tests/symfric/gallery/test_rendering.py",)
T_COMMAND = ("tests/symfric/cli/test_gallery.py",)
T_COMPLETED = ("tests/symfric/cli/test_completions.py",)
T_SCENES = ("tests/symfric/cli/test_scenes_command.py",)
T_FITTED = ("tests/symfric/cli/test_select_fitted.py",)
T_LINKS = ("tests/docs/test_links.py",)
T_STAMP = ("tests/docs/test_stamp.py",)
T_PRINTED = ("tests/docs/test_pages.py::test_printed_text_agrees_up_to_what_is_left_out",)

TOLD = (
    Mutant(
        "least and greatest change places in a report", RESULTS + "report.py",
        "*run.extremes[signal]))", "*run.extremes[signal][::-1]))", results("report"),
    ),
    Mutant(
        "least and greatest of a long run change places", RESULTS + "trajectory.py",
        "(v.min(), v.max())", "(v.max(), v.min())", results("shown_runs"),
    ),
    Mutant(
        "least values are looked for beside the greatest", RESULTS + "quadrature.py",
        "(np.argmin, np.less), (np.argmax, np.greater)",
        "(np.argmin, np.less), (np.argmin, np.greater)", results("extremes"),
    ),
    Mutant(
        "details of a table lose their units", RESULTS + "trajectory.py",
        "[{self.unit(name)}]", "[{self.units.get(name, '')}]", results("trajectory"),
    ),
    Mutant(
        "a table holds all signals whatever is asked for", RESULTS + "trajectory.py",
        "return {name: self[name] for name in names} if names else dict(self.signals)",
        "return dict(self.signals)", results("trajectory"),
    ),
    Mutant(
        "an acceleration has the unit of its velocity", "symfric/model/start.py",
        'PER_SECOND.get(unit, f"{unit}/s" if unit else "")', "unit",
        ("tests/symfric/model/test_accelerations.py",),
    ),
    Mutant(
        "states of laws have accelerations", "symfric/model/start.py",
        "and v.name not in of_laws", "and True", ("tests/symfric/model/test_accelerations.py",),
    ),
    Mutant(
        "packages that begin as ours are ours", FOUNDATION + "packed.py",
        'place.split(".")[0] not in storable.OWN', "not place.startswith(storable.OWN)",
        foundation("packed"),
    ),
    Mutant(
        "what is left out of a table is counted one short", FOUNDATION + "shown.py",
        "rows[: max(0, room - 1)]", "rows[: max(0, room)]", foundation("shown"),
    ),
    Mutant(
        "names in the head of a table are HTML", FOUNDATION + "shown.py",
        'f"{escape(text)}</{mark}>"', 'f"{text}</{mark}>"', foundation("shown"),
    ),
    Mutant(
        "a line style of its own is that of the colour", FOUNDATION + "style.py",
        "dash(k if style is None else style)", "dash(k)", foundation("style"),
    ),
    Mutant(
        "lengths of 0.09 mm are 90 µm", FOUNDATION + "units.py",
        "if top >= LEAST * size:", "if top >= size:", foundation("prefixes"),
    ),
    Mutant(
        "a number and its factor have different prefixes", FOUNDATION + "units.py",
        "if top >= LEAST * size:\n            return 1 / size,",
        "if top >= LEAST * size:\n            return size,", foundation("prefixes"),
    ),
    Mutant(
        "figure 3.2 is figure 3", GALLERY + "plate.py",
        "for part in match.groups() if part)", "for part in match.groups()[:1] if part)",
        T_RENDERING,
    ),
    Mutant(
        "a paragraph behind a section belongs to none", GALLERY + "plate.py",
        "else (at, paragraph)", 'else ("text", paragraph)', T_RENDERING,
    ),
    Mutant(
        "what was drawn before counts as drawn now", GALLERY + "rendering.py",
        "place(folder, name, ending).unlink()", "pass", T_RENDERING,
    ),
    Mutant(
        "who failed counts as left undone", GALLERY + "rendering.py",
        "len(self.asked) - len(self.records) - len(self.failures)",
        "len(self.asked) - len(self.records)", T_COMMAND,
    ),
    Mutant(
        "figures of the same runs are computed one by one", GALLERY + "rendering.py",
        "groups.setdefault(scripts()[name], [])", "groups.setdefault(name, [])", T_RENDERING,
    ),
    Mutant(
        "an interrupted gallery ends as one with failures", CLI + "campaigns.py",
        "INTERRUPTED = 130", "INTERRUPTED = 1", T_COMMAND,
    ),
    Mutant(
        "laws that lack what is needed are fitted, too", CLI + "select.py",
        "if not lacking(words, phenomena(c))}", "if c is not None}", T_FITTED,
    ),
    Mutant(
        "errors from data are in percent", CLI + "select.py",
        "row.fitted / 100", "row.fitted", T_FITTED,
    ),
    Mutant(
        "a number for one law goes to none", CLI + "select.py",
        '[f"{own}={given.pop(key)}"]', "[] if given.pop(key) else []",
        ("tests/symfric/cli/test_select_command.py",),
    ),
    Mutant(
        "inputs are not said to be driven", CLI + "scenes.py",
        "if u.name in machine.inputs", "if False", T_SCENES,
    ),
    Mutant(
        "parameters of a law are shown where none was named", CLI + "scenes.py",
        "if law is not None or n in own}", "if True}", T_SCENES,
    ),
    Mutant(
        "a report of a run that failed ends well", CLI + "run.py",
        "if not run.status.ok:", "if False:", results("report"),
    ),
    Mutant(
        "a report does not say how to do it again", CLI + "run.py",
        "shlex.join([\"symfric\", *sys.argv[1:]])", '""', results("report"),
    ),
    Mutant(
        "laws inside a wrapper are not completed", CLI + "completions.py",
        'for c in "+(")', 'for c in "+")', T_COMPLETED,
    ),
    Mutant(
        "forms of laws are not completed", CLI + "completions.py",
        "[*parameters(law), *options(law)]", "[*parameters(law)]", T_COMPLETED,
    ),
    Mutant(
        "dots of a number stand for anything", PAGES + "pages.py",
        "[re.escape(part) for part in", "[part for part in", T_PRINTED,
    ),
    Mutant(
        "what is printed behind the text of a page is let pass", PAGES + "pages.py",
        "return re.fullmatch(", "return re.match(", T_PRINTED,
    ),
    Mutant(
        "places in other pages are not looked for", PAGES + "links.py",
        "if place and target in pages and", "if place and target == page and", T_LINKS,
    ),
    Mutant(
        "names with blanks are no files", PAGES + "links.py",
        "(page.parent / unquote(parts.path))", "(page.parent / parts.path)", T_LINKS,
    ),
    Mutant(
        "a changed docstring draws all pictures anew", PAGES + "made.py",
        "kept = [e for e in body if not _is_text(e)]", "kept = [*body]", T_STAMP,
    ),
    Mutant(
        "pictures stay whatever changes", PAGES + "made.py",
        "(kept() or stamp.read_text() == key)", "(True or stamp.read_text() == key)", T_STAMP,
    ),
    Mutant(
        "a plate does not depend on what the gallery shares", PAGES + "generated.py",
        "digest([code_hash(), *shared,", "digest([code_hash(),", T_STAMP,
    ),
    Mutant(
        "a plate that failed is not tried again", PAGES + "generated.py",
        "if n not in changed or n in done.records}", "if n}", T_STAMP,
    ),
)  # fmt: skip
