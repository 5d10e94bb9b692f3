"""Inertias and friction of a robot from its URDF and logs of its joints."""
