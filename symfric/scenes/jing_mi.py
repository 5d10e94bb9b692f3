"""Laws' numbers in Jing and Mi, Selection Mechanism of Friction Models, tables 3 and 7."""

from symfric.laws.dynamic.dahl import Dahl
from symfric.laws.dynamic.dwell import Gonthier
from symfric.laws.dynamic.lugre import ElastoPlastic, LuGre
from symfric.laws.dynamic.stick_slip import StickSlip
from symfric.laws.static.applied_force import Awrejcewicz, Karnopp
from symfric.laws.static.coulomb import Coulomb
from symfric.laws.static.piecewise import BengisuAkay, Threlfall, VelocityBased
from symfric.scenes.presets import Numbers

SOURCE = "Jing and Mi, Investigation of Selection Mechanism of Friction Models, tables "


def numbers(
    *, mu_s: float, mu_d: float, v_t: float, v_s: float, v_d: float, v_str: float,
    gonthier: tuple[float, float], sigma_0: float, sigma_1: float, z_ba: float, z_max: float,
    tau_dw: float,
) -> Numbers:  # fmt: skip
    """Numbers of the eleven laws by the rows of a table.

    The tables have no column for it. The tolerance v_t is the width of the laws of one velocity
    (smooth Coulomb, Threlfall, Bengisu-Akay, Karnopp, Awrejcewicz), v_s and v_d are the two of the
    velocity-based and the stick-slip law, v_str is where the Stribeck curve falls, z_max the
    largest stiction deformation of the stick-slip law. The fall of Bengisu-Akay is 1/v_str.

    Args:
        gonthier: its v_s (v_str) and v_d, which must lie below.
    """
    levels = {"mu_s": mu_s, "mu_d": mu_d, "sigma_2": 0.0}
    bristle = {"sigma_0": sigma_0, "sigma_1": sigma_1, "v_s": v_str}
    return Numbers(
        levels,
        {
            Coulomb: {"v_eps": v_t},
            Threlfall: {"v_r": v_t},
            BengisuAkay: {"v_0": v_t, "xi": 1 / v_str},
            Karnopp: {"D_v": v_t},
            VelocityBased: {"v_s": v_s, "v_d": v_d},
            Awrejcewicz: {"epsilon": v_t, "v_s": v_str},
            Dahl: {"sigma_0": sigma_0},
            LuGre: bristle,
            ElastoPlastic: bristle | {"z_ba": z_ba},
            StickSlip: {"v_s": v_s, "v_d": v_d, "D_max": z_max},
            Gonthier: bristle | {"v_s": gonthier[0], "v_d": gonthier[1], "tau_dw": tau_dw},
        },
    )


BELT = numbers(
    mu_s=0.15, mu_d=0.1, v_t=1e-3, v_s=1e-3, v_d=1.5e-3, v_str=1e-3, gonthier=(1e-3, 1e-4),
    sigma_0=1e5, sigma_1=190.0, z_ba=1e-7, z_max=1e-6, tau_dw=0.1,
)  # fmt: skip
"""Table 3. Its one velocity besides v_str, 1 mm/s, is v_t and v_s here; v_d = 1.5 v_s as in ADAMS,
and a tenth of it for Gonthier, are ours."""

BOX = numbers(
    mu_s=0.03, mu_d=0.02, v_t=1e-3, v_s=5e-4, v_d=0.06, v_str=1e-3, gonthier=(1e-5, 1e-6),
    sigma_0=1e4, sigma_1=2.0, z_ba=1e-7, z_max=1e-7, tau_dw=0.01,
)  # fmt: skip
"""Table 7, box. Gonthier's v_d, a tenth of its v_str, is ours: with the table's 0.06 m/s it has no
stiction."""

HINGE = numbers(
    mu_s=0.003, mu_d=0.002, v_t=1e-3, v_s=1e-3, v_d=1e-2, v_str=1e-3, gonthier=(1e-5, 1e-6),
    sigma_0=1e4, sigma_1=2.0, z_ba=1e-7, z_max=1e-7, tau_dw=0.01,
)  # fmt: skip
"""Table 7, simple pendulum; velocities and bristles at the radius of the hinge."""
