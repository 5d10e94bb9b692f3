"""Robots from URDF files."""

from symfric.multibody.urdf.file import parse
from symfric.multibody.urdf.read import read_urdf

__all__ = ["parse", "read_urdf"]
