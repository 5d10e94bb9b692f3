"""Mutants of ensembles on graphics processors: the kernel, and what launches it."""

from mutants.mutant import Mutant

LOOP, MEMBERS = "symfric/integrator/cuda/members.h", "symfric/integrator/cuda/on_device.py"
CUPY, DOOR = "symfric/integrator/cuda/device.py", "symfric/integrator/cuda/on_device.py"
T_DEVICE = ("tests/symfric/integrator/cuda/test_on_device.py",)
T_CUPY = ("tests/symfric/integrator/cuda/test_cupy_device.py",)

DEVICES = (
    Mutant(
        "device: a member that goes on begins its interval again", LOOP,
        "if (all->reason[m] == RUNNING) {", "if (all->reason[m] == 99) {", T_DEVICE,
    ),
    Mutant(
        "device: results at a break are of the interval before", LOOP,
        "(is_last(all, x) ? due <= x->end : due < x->end)", "due <= x->end", T_DEVICE,
    ),
    Mutant(
        "device: attempts of earlier launches are forgotten", LOOP,
        "x->left = all->max_attempts - all->made[m];", "x->left = all->max_attempts;", T_DEVICE,
    ),
    Mutant(
        "device: algebraic unknowns follow without a guard", LOOP,
        "if (!(look[2] >= 0)) return 0;", "", T_DEVICE,
    ),
    Mutant(
        "device: a launch takes the first members again and again", MEMBERS,
        "todo = np.concatenate([begun, waiting]).astype(np.int32)",
        "todo = todo[: begun.size + waiting.size]", T_DEVICE,
    ),
    Mutant(
        "device: dense output is left out though results want it", DOOR,
        "between = not np.isin(times, breaks).all()", "between = False", T_DEVICE,
    ),
    Mutant(
        "device: products go unrounded into sums", CUPY,
        'OPTIONS = ("--fmad=false",)', "OPTIONS = ()", T_CUPY,
    ),
    Mutant(
        "device: nobody waits for a launch", CUPY,
        "            self.cupy.cuda.get_current_stream().synchronize()\n", "", T_CUPY,
    ),
)  # fmt: skip
