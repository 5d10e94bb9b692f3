"""Block on a belt with smooth friction in AUTO-07p: equilibria, Hopf points, orbits, fold.

    x' = v,   v' = -x - tanh(r / v_t) (1 + 0.5 exp(-(r / 0.2)^2)) - 0.1 r,   r = v - v_b

The program is compiled by gfortran with the object files of Debian's package `auto-07p`, and called
with its files fort.2 (constants), fort.3 (start), fort.7 (branch) and fort.8 (solutions).
"""

import os
import shutil
import subprocess
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import NamedTuple

import numpy as np

from symfric.foundation.numeric import Array

FOLDER = Path("/usr/lib/auto-07p/lib")
SOURCE = """
SUBROUTINE FUNC(NDIM,U,ICP,PAR,IJAC,F,DFDU,DFDP)
  INTEGER NDIM,ICP(*),IJAC
  DOUBLE PRECISION U(NDIM),PAR(*),F(NDIM),DFDU(NDIM,*),DFDP(NDIM,*),R
  R=U(2)-PAR(1)
  F(1)=U(2)
  F(2)=-U(1)-TANH(R/{width:e})*(1+0.5D0*EXP(-(R/0.2D0)**2))-0.1D0*R
END SUBROUTINE
SUBROUTINE STPNT(NDIM,U,PAR,T)
  INTEGER NDIM
  DOUBLE PRECISION U(NDIM),PAR(*),T
  PAR(1)=0.8D0
  U(1)=1.0D0+0.5D0*EXP(-16.0D0)+0.08D0
  U(2)=0
END SUBROUTINE
""" + "".join(f"SUBROUTINE {name}\nEND SUBROUTINE\n" for name in ("BCND", "ICND", "FOPT", "PVLS"))
CONSTANTS = """
NDIM=2, IPS={ips}, IRS={start}, ILP=1, ICP=[{free}], NTST={mesh}, NCOL=4, IAD=3, ISP=2, ISW=1
NMX={points}, NPR=1000, MXBF=0, IID=2, ITMX=8, ITNW=5, NWTN=3, JAC=0
EPSL={eps}, EPSU={eps}, EPSS=1e-6, DS={step}, DSMIN=1e-7, DSMAX={longest}, IADS=1
UZSTOP={{1:[0.02,2.0]}}
"""
FOLD, HOPF = 5, 3
"""Types of special points of AUTO."""


class Found(NamedTuple):
    """Results of AUTO.

    Attributes:
        hopf: belt speeds of the Hopf points [m/s], the largest first.
        fold: belt speed of the fold of the orbits [m/s]; NaN if it was not found.
        points: number of orbits.
        last: belt speed of the last orbit [m/s].
        seconds: processor time of both runs without compiling [s].
    """

    hopf: Array
    fold: float
    points: int
    last: float
    seconds: float


def installed() -> bool:
    """Return True if AUTO and a Fortran compiler are installed."""
    return FOLDER.is_dir() and shutil.which("gfortran") is not None


def belt(width: float, points: int, mesh: int = 200) -> Found:
    """Return the branches of the belt with the smoothing width v_t [m/s].

    Args:
        width: v_t.
        points: number of orbits.
        mesh: number of mesh intervals of an orbit.
    """
    with TemporaryDirectory() as name:
        folder = Path(name)
        (folder / "belt.f90").write_text(SOURCE.format(width=width).replace("e-", "D-"), "utf-8")
        objects = map(str, sorted(FOLDER.glob("*.o")))
        call = ["gfortran", "-fopenmp", "-O2", "belt.f90", *objects, "-o", "belt"]
        subprocess.run(call, cwd=folder, check=True, capture_output=True)
        rest, first = _run(folder, ips=1, start=0, free="1", step=-0.01, longest=0.02, points=300)
        hopf = rest[rest[:, 2] == HOPF]
        shutil.move(folder / "fort.8", folder / "fort.3")
        orbits, second = _run(
            folder, ips=2, start=int(hopf[0, 3]), free="1,11", step=0.01, longest=0.05,
            points=points, mesh=mesh, eps=1e-7,
        )  # fmt: skip
    folds = orbits[orbits[:, 2] == FOLD, 4]
    fold = float(folds[0]) if folds.size else np.nan
    return Found(hopf[:, 4], fold, len(orbits), float(orbits[-1, 4]), first + second)


def _run(
    folder: Path, *, mesh: int = 20, eps: float = 1e-10, **constants: object
) -> tuple[Array, float]:
    """Return the rows of fort.7 (branch, point, type, label, v_b, ...) and the processor time."""
    (folder / "fort.2").write_text(CONSTANTS.format(mesh=mesh, eps=eps, **constants), "utf-8")
    (folder / "fort.3").touch()
    before, threads = os.times(), {**os.environ, "OMP_NUM_THREADS": "1"}
    subprocess.run(["./belt"], cwd=folder, check=True, capture_output=True, env=threads)
    after = os.times()
    seconds = after.children_user + after.children_system
    seconds -= before.children_user + before.children_system
    lines = (folder / "fort.7").read_text("utf-8").splitlines()
    rows = [line.split()[:5] for line in lines if line.split()[0] != "0"]
    return np.array([[float(cell) for cell in row] for row in rows]), seconds
