"""Run a plant and its controller as C in real time, and measure time, jitter and error.

    m v' = force - F(v),   m = 1 kg,   F: bristles, 6 N to break away, 4 N while sliding

Every millisecond, a C program reads the position of the plant, computes the force of a PD
controller with a friction compensator in float, and advances the plant in double by four steps of
0.25 ms. On a target, the plant is the machine, or a simulator on a second board, and the two marked
places become inputs and outputs. The recorded forces are applied to the plant again with adaptive
steps; the difference is the error of the fixed steps. Needs Linux and a C compiler.

    python examples/hardware_in_the_loop.py [OUT]
"""

import subprocess
import sys
from pathlib import Path

import numpy as np

from symfric import LuGre, simulate
from symfric.codegen import generate, plant_block
from symfric.compensation import compensator
from symfric.foundation.panels import panels, save
from symfric.foundation.programs import find_compiler
from symfric.integrator import Hold
from symfric.scenes import Drive

LAW = LuGre(mu_s=6.0, mu_d=4.0, v_s=5e-3, sigma_0=1e5, sigma_1=300.0, sigma_2=20.0)
SCENE = Drive(LAW, m=1.0, N=1.0)
H, CYCLES, STEPS = 1e-3, 2000, 4
LOOP = Path(__file__).with_suffix(".c")


def main(out: Path) -> None:
    """Generate, compile and run the loop, print its measurements, and write a picture."""
    compiler = find_compiler()
    if compiler is None or not sys.platform.startswith("linux"):
        raise SystemExit("expected Linux and a C compiler")
    made = [
        generate(plant_block(SCENE, h=H / STEPS), out / "c", real="double", kit=False),
        generate(compensator(LAW, N=1.0, limit=10.0, h=H), out / "c", real="float", kit=False),
    ]
    sources = [str(LOOP), *(str(g.source(g.reals[0])) for g in made)]
    flags = ("-std=c99", "-O2", f"-DCYCLES={CYCLES}", f"-DSTEPS={STEPS}", f"-I{out / 'c'}")
    compiler.run(*flags, *sources, "-lm", "-o", str(out / "loop"))
    printed = subprocess.run([out / "loop"], capture_output=True, text=True, check=True).stdout
    x, force, late, busy = np.loadtxt(printed.splitlines()).T
    t = H * np.arange(CYCLES)
    exact = simulate(SCENE.model(), t[-1], u={"force": Hold(t, force)}, t_eval=t, rtol=1e-9)
    print(f"cycle: {1e6 * busy.mean():.1f} us, longest {1e6 * busy.max():.1f} us of 1000 us")
    print(f"jitter: {1e6 * late.std():.1f} us, latest start {1e6 * late.max():.1f} us")
    missed = (x - 0.02 * np.sin(2 * np.pi * t))[t > 0.5]
    print(f"tracking error after 0.5 s: {1e6 * np.abs(missed).max():.1f} um")
    print(f"error of the plant: {1e6 * np.abs(x - exact['x']).max():.3f} um")
    figure, (above, below) = panels(2)
    above.plot(t, 1e3 * x)
    above.set(ylabel="x [mm]", title="Plant and controller as C at 1 kHz")
    below.semilogy(t, 1e6 * busy, label="cycle")
    below.semilogy(t, 1e6 * late, label="late start")
    below.set(xlabel="t [s]", ylabel="time [us]")
    below.legend(loc="center right")
    save(figure, out / "hardware_in_the_loop.png")


if __name__ == "__main__":
    main(Path(sys.argv[1] if len(sys.argv) > 1 else "out"))
