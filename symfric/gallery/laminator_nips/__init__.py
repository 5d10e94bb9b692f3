"""A Friction Model for Laminator Nips, MSc thesis TFRT-5968, Lund 2015.

Carton is pulled over rubber at constant speeds, and the static parameters of LuGre are identified
from the mean forces, in a pilot and in a main study. The thesis prints the parameters and not the
points: ours are made of its parameters and of noise like its own, 8 % of the mean, most of it at
low speeds, and identified again. So nothing here says whether the law fits rubber and carton; what
it says is what points of this quality can tell.
"""
