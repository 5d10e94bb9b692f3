"""Mutants of the gallery: what it compares with, what it tells, what it keeps."""

from mutants.mutant import Mutant

BELT = "symfric/gallery/shared.py"
MACHINES = "symfric/gallery/self_tuning/machines.py"
ORACLE = "symfric/gallery/self_tuning/machines.py"
PLATE = "symfric/gallery/plate.py"
SLED = "symfric/gallery/laminator_nips/sled.py"
RENDERING = "symfric/gallery/rendering.py"
T_HAND = ("tests/symfric/gallery/test_answers_by_hand.py",)
T_FIGURES = ("tests/symfric/gallery/test_plates.py",)
T_PLATES = ("tests/symfric/gallery/test_rendering.py",)
T_COMMAND = ("tests/symfric/cli/test_gallery.py",)

SHOWN = (
    Mutant(
        "the block slips at its static level",
        BELT,
        "F[here] = -self.F_C",
        "F[here] = -self.F_S",
        T_HAND,
    ),
    Mutant(
        "the block leaves the belt early",
        BELT,
        "at = self.F_S / self.k if sticks",
        "at = self.F_C / self.k if sticks",
        T_HAND,
    ),
    Mutant(
        "a slack wire pushes",
        SLED,
        "np.maximum(spring + d * (V - w), 0.0)",
        "spring + d * (V - w)",
        T_HAND,
    ),
    Mutant(
        "the sled rests half as long",
        SLED,
        "rest = np.linspace(0.0, (begin - spring[-1]) / (Z * V), 4001)",
        "rest = np.linspace(0.0, (begin - spring[-1]) / (2 * Z * V), 4001)",
        T_HAND,
    ),
    Mutant(
        "rod 2-3 pulls slider 2 the other way",
        MACHINES,
        "(l5 + l6) * y2",
        "(l5 - l6) * y2",
        T_HAND,
    ),
    Mutant(
        "the thrust face of the bearing does not rub",
        MACHINES,
        "N - size(f1) - size(f2) - size(F[0])",
        "N - size(f1) - size(f2)",
        T_HAND,
    ),
    Mutant(
        "the last stage of fixed steps is half a step",
        ORACLE,
        "k4 = rate(y + h * k3)",
        "k4 = rate(y + h / 2 * k3)",
        T_HAND,
    ),
    Mutant(
        "numbers that are not finite are shown",
        PLATE,
        "if not isfinite(v)]",
        "if v != v]",
        T_PLATES,
    ),
    Mutant(
        "fig_0 begins fig_07",
        PLATE,
        '.startswith((f"{start}_", f"{start}/"))',
        ".startswith(start)",
        T_PLATES,
    ),
    Mutant(
        "a figure whose text is untrue is drawn",
        PLATE,
        "for sentence, holds in claims.items() if not holds]",
        "for sentence, holds in claims.items() if holds is None]",
        ("tests/symfric/gallery/test_plates.py::test_a_figure_whose_text_is_untrue_is_not_drawn",),
    ),
    Mutant(
        "a figure beyond its bound is drawn",
        PLATE,
        "if distance > within:",
        "if distance > 1e3 * within:",
        T_FIGURES,
    ),
    Mutant(
        "verdicts are printed at reduced size",
        PLATE,
        "verdicts={} if quick else {",
        "verdicts={",
        T_FIGURES,
    ),
    Mutant(
        "a block that still stretches its bristles has broken away",
        "symfric/figures/pushing.py",
        "way = 2 * (own.velocity + rate * stretch / own.static), SLID * stretch",
        "way = 2 * (own.velocity + rate * stretch / own.static), 0.0",
        ("tests/symfric/figures/test_break_away.py",),
    ),
    Mutant(
        "quadrature does not look into a step",
        "symfric/results/quadrature.py",
        "rough = off > EXACT * ",
        "rough = off > 1e9 * ",
        ("tests/symfric/results/test_quadrature.py",),
    ),
    Mutant(
        "an area forgets that its abscissa depends on time",
        "symfric/results/signals.py",
        " + ca.jacobian(signal, model.t)",
        "",
        ("tests/symfric/results/test_quadrature.py",),
    ),
    Mutant(
        "a figure that fails takes the others with it",
        RENDERING,
        "except Exception as error:",
        "except ValueError as error:",
        T_PLATES,
    ),
    Mutant(
        "who died has what it had done told as failed",
        RENDERING,
        'for name in group if not place(folder, name, ".json").exists()}',
        "for name in group}",
        T_PLATES,
    ),
    Mutant(
        "a gallery with failures ends well",
        "symfric/cli/campaigns.py",
        "    if done.failures:\n        raise typer.Exit(1)",
        "    pass",
        T_COMMAND,
    ),
)
