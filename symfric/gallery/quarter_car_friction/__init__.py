"""Al-Zughaibi: Nonlinear Friction Model for Passive Suspension System Identification and
Effectiveness, a chapter on friction in the guides of a quarter-car test rig.

The chapter states masses, springs and dampers, the break-away force, and the rest positions of the
body. It states neither C_e, e1, mu and sigma_v of its friction, nor the length of the strut and the
times of the road; ours are invented (`QuarterCarGeneral`, `rig`). The text does not contain its
measured curves; each figure is compared with the equations solved in another way, and with the
statements of the text.
"""
