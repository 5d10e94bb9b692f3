"""Mutants of ensembles and of what they leave on disk."""

from mutants.mutant import Mutant

STORE = "symfric/integrator/many/store.py"
LOOP, LANES = "symfric/integrator/many/loop.h", "symfric/integrator/many/lanes.h"
T_LANES = ("tests/symfric/integrator/many/test_vectors.py",)
T_GIVEN = ("tests/symfric/integrator/many/test_given.py",)
T_STORE = ("tests/symfric/integrator/many/test_store.py",)

ENSEMBLES = (
    Mutant(
        "results on disk are taken unseen", STORE,
        'if str(saved["checksum"]) == self._checksum(first, attempts.size):', "if True:", T_STORE,
    ),
    Mutant(
        "an ensemble of other inputs is taken over", "symfric/integrator/ensemble.py",
        "parts.append(digest(*_alone(integrator, given, pick)))",
        "parts.append(digest(*_alone(integrator, given, pick)[:2]))", T_STORE,
    ),
    Mutant(
        "results wait for a member that is gone", LOOP,
        "if (common->ready) give(common);", "", T_LANES,
    ),
    Mutant(
        "a lane keeps the attempts of the member before", LOOP,
        "x->left[l] = all->max_attempts - all->made[m];", "", T_LANES,
    ),
    Mutant(
        "angles are reduced by a pi of less digits", LANES,
        "const V small = (e1 + e2) - k * 0x1.b839a252049c1p-104;", "const V small = ALL(0.);",
        T_LANES,
    ),
    Mutant(
        "a value is lost between parts of vector code", "symfric/integrator/many/vectors.py",
        "if self.last.get(i, k) > k:", "if self.last.get(i, k) > k + 1:", T_LANES,
    ),
    Mutant(
        "a member that ends early runs on to the next break", LOOP,
        "return k >= all->intervals || all->breaks[k] >= all->ends[x->member[l]];",
        "return k >= all->intervals;", T_GIVEN,
    ),
    Mutant(
        "all members get the inputs of the first", LOOP,
        "const double *data = all->data + m * all->data_step;",
        "const double *data = all->data;", T_GIVEN,
    ),
    Mutant(
        "members go into the rows before theirs", STORE,
        "+ 8 * first * self.shape[1])", "+ 8 * max(0, first - 1) * self.shape[1])", T_STORE,
    ),
    Mutant("a file cut short is taken", STORE, "and status.st_size == size", "", T_STORE),
    Mutant(
        "who comes last has the file", STORE,
        "                if missing:", "                if False:", T_STORE,
    ),
)  # fmt: skip
