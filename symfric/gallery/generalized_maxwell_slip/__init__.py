"""Lampaert, Al-Bender, Swevers: A Generalized Maxwell-Slip Friction Model appropriate for Control
Purposes, Physics and Control 2003.

Table 1 of the paper states F_s, F_c, V_s, delta, sigma_0, sigma_1, z_ba, delta_l and C. The paper
states neither the elements k_i, alpha_i, nor the hysteresis F_h, nor the mass, nor a formula of the
generic model and of the signals. Our choices are described in `laws`; the elements are identified
from the generic model, as in the paper. The text does not contain the curves; each figure is
compared with the same equations written by hand, with closed forms, and with the statements of the
text on the curves.
"""
