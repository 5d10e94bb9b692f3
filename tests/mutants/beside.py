"""Mutants of what is loaded late, made in the background, written out or eliminated."""

from mutants.mutant import Mutant

LAZY = "symfric/foundation/lazy.py"
BACKGROUND = "symfric/integrator/compiled/background.py"
COMPILER = "symfric/integrator/compiled/compiler.py"
BRANCHES = "symfric/integrator/equations/expressions.py"
ELIMINATED = "symfric/integrator/methods/explicit.py"
WRITTEN = "symfric/integrator/step/attempt.py"
T_LAZY = ("tests/symfric/foundation/test_lazy.py",)
T_BACKGROUND = ("tests/symfric/integrator/compiled/test_background.py",)
T_BRANCHES = ("tests/symfric/integrator/equations/test_branches.py",)
T_ELIMINATED = ("tests/symfric/integrator/equations/test_eliminated.py",)
T_WRITTEN = ("tests/symfric/integrator/step/test_written.py",)

BESIDE = (
    Mutant(
        "a submodule replaces the function of its name", LAZY,
        "if not (isinstance(value, ModuleType) and name in self._places):", "if True:", T_LAZY,
    ),
    Mutant(
        "the table of commands loads them", "symfric/cli/app.py",
        "formatter.write_dl([*COMMANDS.items()])",
        "formatter.write_dl([(n, self.get_command(ctx, n).help) for n in COMMANDS])", T_LAZY,
    ),
    Mutant(
        "an exit leaves its compiler alone", BACKGROUND,
        "        _row[0].end()", "        pass", T_BACKGROUND,
    ),
    Mutant(
        "a forked process starts compilers", BACKGROUND,
        "return processors() > 1 and os.getpid() == _OWNER", "return processors() > 1",
        T_BACKGROUND,
    ),
    Mutant(
        "a compiler that hangs is waited for", COMPILER,
        "if status is None and perf_counter() < self.limit:", "if status is None:", T_BACKGROUND,
    ),
    Mutant(
        "what was compiled beside is not kept", COMPILER,
        "            self.place.keep(self.key, self.path)", "            pass", T_BACKGROUND,
    ),
    Mutant(
        "the tangent turns over too early", BRANCHES, "MIDDLE = 0.7", "MIDDLE = 0.3", T_BRANCHES
    ),
    Mutant(
        "a digit of the tangent is lost", BRANCHES, "0.46148568660258626", "0.46148568660268626",
        T_BRANCHES,
    ),
    Mutant(
        "steps differentiate the long tangent", "symfric/integrator/equations/system.py",
        "return replace(self, slope=self.J, branchless=False)", "return self", T_BRANCHES,
    ),
    Mutant(
        "accelerations stay those of the stage before", ELIMINATED,
        "    settled[columns] = solve(", "    solve(", T_ELIMINATED,
    ),
    Mutant(
        "friction from reactions counts as linear", ELIMINATED,
        "if ca.depends_on(G, z):", "if False:", T_ELIMINATED,
    ),
    Mutant(
        "large steps are written out to be counted", WRITTEN,
        "if least(system, method) <= inline:", "if True:", T_WRITTEN,
    ),
)  # fmt: skip
"""Of this file."""
