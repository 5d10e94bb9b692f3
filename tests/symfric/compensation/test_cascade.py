"""The position controller against its equations, step by step."""

from one_program import Stepper

from symfric.compensation import Cascade

H, COUNT = 1e-3, 1e-3
OWN = Cascade(h=H, kp=10.0, kv=5.0, ki=2.0, inertia=3.0, limit=4.0, count=COUNT, share=0.25)


def controller() -> Stepper:
    return Stepper(OWN.block())


def test_the_encoder_says_the_nearest_count_and_its_difference_is_filtered() -> None:
    go, v = controller(), 0.0
    for x, counts, before in ((1.4e-3, 1, 0), (1.6e-3, 2, 1), (-0.6e-3, -1, 2), (-0.4e-3, 0, -1)):
        found = go(x=x)
        v += 0.25 * ((counts - before) * COUNT / H - v)
        assert abs(found["x_m"] - counts * COUNT) < 1e-15
        assert abs(found["v_m"] - v) < 1e-12
        assert abs(found["e"] + counts * COUNT) < 1e-15


def test_the_force_is_that_of_its_equation_and_the_integral_grows_by_it() -> None:
    go = controller()
    first = go(r=0.02, v_ref=0.1, a_ref=0.2)
    assert abs(first["v_s"] - 0.3) < 1e-12
    assert abs(first["u"] - (5.0 * 0.3 + 3.0 * 0.2)) < 1e-12
    assert abs(go.x[2] - 2.0 * 5.0 * H * 0.3) < 1e-12
    second = go(r=0.02, v_ref=0.1)
    assert abs(second["u"] - (5.0 * 0.3 + 3e-3)) < 1e-12


def test_the_integral_stands_where_the_force_has_reached_its_limit_and_comes_back() -> None:
    go = controller()
    for _ in range(100):
        assert go(v_ref=2.0)["u"] == 4.0
    assert go.x[2] == 0.0
    assert go(v_ref=-2.0)["u"] == -4.0
    assert go.x[2] == 0.0
    for _ in range(10):
        go(v_ref=0.1)
    assert abs(go.x[2] - 10 * 2.0 * 5.0 * H * 0.1) < 1e-12
    go(v_ref=-2.0, a_ref=10.0)  # pushed to the other limit by the acceleration: it goes on to fall
    assert go.x[2] < 0.0


def test_the_integral_stands_on_hold() -> None:
    go = controller()
    go(v_ref=0.1, hold=1.0)
    assert go.x[2] == 0.0
    go(v_ref=0.1, hold=0.5)
    assert go.x[2] > 0.0
