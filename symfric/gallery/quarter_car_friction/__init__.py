"""Al-Zughaibi: Nonlinear Friction Model for Passive Suspension System Identification and
Effectiveness, a chapter on friction in the guides of a quarter-car test rig.

It gives masses, springs and dampers, the break-away force, and where the body rests; it gives
neither C_e, e1, mu and sigma_v of its friction, nor the length of the strut and the times of the
road. Ours are invented (`QuarterCarGeneral`, `_rig`). Its measured curves cannot be read from text;
each figure is compared with the equations solved in another way, and with what the text says.
"""
