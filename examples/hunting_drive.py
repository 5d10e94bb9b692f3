"""A drive under PID control hunts around its target: how far, how fast, and how it stops.

    m v' = u - F,   u = -k_p x - k_d v - k_i e,   e' = x,   m = 1 kg

The static friction of the guide is three times its dynamic friction. The integrator winds up until
the guide breaks away, and the axis overshoots. This repeats as a periodic motion with two phases of
stick, whose halves mirror each other. The force of friction is set-valued at rest; nothing is
smoothed. More damping k_d makes the motion smaller, until stable hunting meets an unstable orbit in
a fold. Beyond this damping the axis comes to rest.

    python examples/hunting_drive.py [OUT]
"""

import sys
from pathlib import Path

import casadi as ca

from symfric import ExactCoulomb, Model, Variable, contact, simulate
from symfric.dynamics import continuation, periodic_orbit
from symfric.results.pictures import plot_trajectories

FRICTION = ExactCoulomb(mu_s=0.3, mu_d=0.1, v_s=0.05, form="stribeck")
APART = 0.02
"""Distance from the fold at which both sides are simulated, relative to its damping."""


def axis() -> Model:
    """Return the axis with its controller; k_d is a parameter."""
    x = Variable("x", "m", start=0.05, nominal=0.05, doc="distance from the target")
    v = Variable("v", "m/s", nominal=0.1, doc="velocity")
    e = Variable("e", "m s", nominal=0.1, doc="integrated distance")
    k_d = Variable("k_d", "N s/m", start=3.0, doc="damping of the controller")
    force = -60 * x - k_d * v - 25 * e
    guide = contact("guide", FRICTION, v.symbol, 9.81, {"v": 0.0}, F_e=force)
    rates = ca.vertcat(v.symbol, force - guide.force, x.symbol)
    return Model("axis", x=(x, v, e), p=(k_d,), ode=rates, contacts=(guide,))


def main(out: Path) -> None:
    """Find the orbit, follow it over the damping, check by runs, print, and write pictures."""
    model = axis()
    start = periodic_orbit(model, simulate(model, 150.0), symmetric=True)
    print(f"hunts {1e3 * start.amplitude('x'):.2f} mm every {start.period:.4f} s", end="")
    print(f", stable: {start.stable}, {' '.join(start.events)}")
    start.plot("x", "v", path=out / "hunting_orbit.png")

    whole = periodic_orbit(model, simulate(model, 150.0))
    branch = continuation(whole, "k_d", (1.0, 20.0), points=100)
    (fold,) = branch.located("fold")
    print(f"hunting ends in a fold at k_d = {fold.value:.5f} N s/m, period {fold.period:.3f} s")
    branch.plot("x", path=out / "hunting_branch.png")

    near = int(abs(branch.values - (1 - APART) * fold.value)[branch.stable].argmin())
    x0 = dict(branch.orbit(near).x)
    runs = {}
    for share in (1 - APART, 1 + APART):
        k_d = share * fold.value
        run = simulate(model, 400.0, x0=x0, p={"k_d": k_d}, rtol=1e-8)
        late = run.at([320.0 + 2.0 * i for i in range(41)])["x"]
        print(f"k_d = {k_d:.3f} N s/m: {1e3 * float(abs(late).max()):.2f} mm after 320 s")
        runs[f"k_d = {k_d:.2f} N s/m"] = run
    plot_trajectories(runs, ["x"], out / "hunting_runs.png")


if __name__ == "__main__":
    folder = Path(sys.argv[1] if len(sys.argv) > 1 else "out")
    folder.mkdir(parents=True, exist_ok=True)
    main(folder)
