"""Figures of the behaviour of friction laws, as data that can be plotted."""

from typing import TYPE_CHECKING

from symfric.foundation.lazy import load_lazily

if TYPE_CHECKING:
    from symfric.figures.catalogue import FIGURES as FIGURES
    from symfric.figures.catalogue import compare as compare
    from symfric.figures.catalogue import figure as figure
    from symfric.figures.data import Curve as Curve
    from symfric.figures.data import FigureData as FigureData
    from symfric.figures.data import phenomena as phenomena
    from symfric.figures.motion import Scales as Scales
    from symfric.figures.motion import scales as scales
    from symfric.figures.pushing import break_away as break_away
    from symfric.figures.pushing import drift as drift
    from symfric.figures.pushing import push as push
    from symfric.figures.pushing import stiction as stiction
    from symfric.figures.recommended import Recommendation as Recommendation
    from symfric.figures.recommended import recommended as recommended
    from symfric.figures.sliding import dwell as dwell
    from symfric.figures.sliding import hysteresis as hysteresis
    from symfric.figures.sliding import lag as lag
    from symfric.figures.sliding import profile as profile
    from symfric.figures.sliding import steady_state as steady_state
    from symfric.figures.sliding import sweep_b as sweep_b
    from symfric.figures.sliding import sweep_c as sweep_c
    from symfric.figures.sliding import sweep_e as sweep_e
    from symfric.figures.sliding import transition as transition
    from symfric.figures.sliding import velocity_step as velocity_step

load_lazily(__name__)
