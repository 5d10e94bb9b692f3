"""Jing and Mi, Investigation of Selection Mechanism of Friction Models in Multibody Systems.

Eleven laws on Rabinowicz's belt and on a pendulum hinged to a sliding box. The tables are printed;
the curves of the figures are not in the text. Each figure is compared with the statements of the
text and the tables, with exact dry friction, and with the same machine computed in another way.
"""
