"""Defects of the scenes: presets, places, machines, the tribometer."""

from mutants.mutant import Mutant

PRESETS = "symfric/scenes/presets.py"
JING_MI = "symfric/scenes/jing_mi.py"
CLUTCH = "symfric/scenes/rotating.py"
BLOCKS = "symfric/scenes/blocks.py"
DRILL = "symfric/scenes/rotating.py"
NIP = "symfric/scenes/rotating.py"
GIVEN = "symfric/scenes/rigs.py"
RATES = "symfric/integrator/equations/inputs.py"
T_PRESETS = ("tests/symfric/scenes/test_presets.py",)
T_CLUTCH = ("tests/symfric/scenes/test_clutch.py",)

MACHINES = (
    Mutant(
        "a preset does not reach into a wrapper", PRESETS,
        "held[item.name] = self.given(value)", "held[item.name] = value", T_PRESETS,
    ),
    Mutant(
        "the stick-slip law of the box takes the speeds of the hinge", JING_MI,
        "mu_s=0.03, mu_d=0.02, v_t=1e-3, v_s=5e-4, v_d=0.06",
        "mu_s=0.03, mu_d=0.02, v_t=1e-3, v_s=1e-3, v_d=1e-2", T_PRESETS,
    ),
    Mutant(
        "one face of a clutch is forgotten where it holds", CLUTCH,
        "(self.n * self.R * both)", "(self.R * both)", T_CLUTCH,
    ),
    Mutant(
        "the plates of a clutch are pulled together", CLUTCH,
        "smooth.positive(pressure.symbol * self.A, 0.0)", "pressure.symbol * self.A", T_CLUTCH,
    ),
    Mutant(
        "the spring between blocks pulls one of them only", BLOCKS,
        "-self.k_2 * x_2.symbol - between", "-self.k_2 * x_2.symbol",
        ("tests/symfric/scenes/test_coupled_blocks.py",),
    ),
    Mutant(
        "half a lump of the string is lost at the bit", DRILL,
        "(self.J_bit + J / 2)", "self.J_bit", ("tests/symfric/scenes/test_drill_string.py",),
    ),
    Mutant(
        "a nip that the web carries does not accelerate with it", NIP,
        "pull = mass * gain - shaft / self.R", "pull = -shaft / self.R",
        ("tests/symfric/scenes/test_nip.py",),
    ),
    Mutant(
        "a measured load presses backwards", GIVEN,
        "smooth.positive(load.symbol - self.N_least, 0.0) + self.N_least", "load.symbol",
        ("tests/symfric/scenes/test_prescribed.py",),
    ),
    Mutant(
        "a position moves on before its first sample", RATES,
        "np.concatenate([still, slopes, still], axis=-1)",
        "np.concatenate([slopes[..., :1], slopes, still], axis=-1)",
        ("tests/symfric/integrator/equations/test_rates.py",),
    ),
)  # fmt: skip
