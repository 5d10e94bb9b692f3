"""A Friction Model for Laminator Nips, MSc thesis TFRT-5968, Lund 2015.

Carton is pulled over rubber at constant speeds, and the static parameters of LuGre are identified
from the mean forces, in a pilot and in a main study. The thesis prints the parameters but not the
points. Our points are computed from its parameters with noise of the same size, 8 % of the mean,
most of it at low speeds, and the parameters are identified from them again. Therefore the figures
do not show whether the law fits rubber and carton, but what points of this quality determine.
"""
