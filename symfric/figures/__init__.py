"""The figures in which papers show what friction laws do: data first, pictures on request."""

from typing import TYPE_CHECKING

from symfric.foundation.fronts import hand_out

if TYPE_CHECKING:
    from symfric.figures.break_away import break_away as break_away
    from symfric.figures.catalogue import FIGURES as FIGURES
    from symfric.figures.catalogue import figure as figure
    from symfric.figures.compare import compare as compare
    from symfric.figures.data import Curve as Curve
    from symfric.figures.data import FigureData as FigureData
    from symfric.figures.drift import drift as drift
    from symfric.figures.dwell import dwell as dwell
    from symfric.figures.hysteresis import hysteresis as hysteresis
    from symfric.figures.lag import lag as lag
    from symfric.figures.profile import profile as profile
    from symfric.figures.push import push as push
    from symfric.figures.recommended import Recommendation as Recommendation
    from symfric.figures.recommended import recommended as recommended
    from symfric.figures.requirements import phenomena as phenomena
    from symfric.figures.scales import Scales as Scales
    from symfric.figures.scales import scales as scales
    from symfric.figures.steady_state import steady_state as steady_state
    from symfric.figures.stiction import stiction as stiction
    from symfric.figures.sweeps import sweep_b as sweep_b
    from symfric.figures.sweeps import sweep_c as sweep_c
    from symfric.figures.sweeps import sweep_e as sweep_e
    from symfric.figures.transition import transition as transition
    from symfric.figures.velocity_step import velocity_step as velocity_step
else:
    hand_out(
        __name__,
        {
            "symfric.figures.break_away": "break_away",
            "symfric.figures.catalogue": "FIGURES figure",
            "symfric.figures.compare": "compare",
            "symfric.figures.data": "Curve FigureData",
            "symfric.figures.drift": "drift",
            "symfric.figures.dwell": "dwell",
            "symfric.figures.stiction": "stiction",
            "symfric.figures.velocity_step": "velocity_step",
            "symfric.figures.hysteresis": "hysteresis",
            "symfric.figures.lag": "lag",
            "symfric.figures.profile": "profile",
            "symfric.figures.push": "push",
            "symfric.figures.recommended": "Recommendation recommended",
            "symfric.figures.requirements": "phenomena",
            "symfric.figures.scales": "Scales scales",
            "symfric.figures.steady_state": "steady_state",
            "symfric.figures.sweeps": "sweep_b sweep_c sweep_e",
            "symfric.figures.transition": "transition",
        },
    )
