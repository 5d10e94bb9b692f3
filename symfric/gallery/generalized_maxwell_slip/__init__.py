"""Lampaert, Al-Bender, Swevers: A Generalized Maxwell-Slip Friction Model appropriate for Control
Purposes, Physics and Control 2003.

Its table 1 gives F_s, F_c, V_s, delta, sigma_0, sigma_1, z_ba, delta_l and C. It gives neither the
elements k_i, alpha_i, nor the hysteresis F_h, nor the mass, nor a formula of the generic model
and of the signals: what we took for them is said in `_laws`, and found from the generic model as
the paper did it. Curves cannot be read from text; each figure is compared with the same equations
written again by hand, with closed forms, and with what the text says of the curves.
"""
