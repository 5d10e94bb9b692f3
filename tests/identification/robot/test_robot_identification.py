"""Identification of a robot: truth, intervals, predictions, files and bad input."""

import numpy as np
import pytest
from crane import COULOMB, NAMES, OFFSET, VISCOUS, log, newton_euler, urdf, waves
from tables import sampled

from identification import Dataset, identify_robot, load_robot, robot_information
from identification.data.filters import lowpass
from identification.robot.base import base_of, pseudo_inertia
from identification.robot.dynamics import RobotModel

TRUTH = {
    name: {"mu_d": c, "sigma_2": d, "offset": o}
    for name, c, d, o in zip(NAMES, COULOMB, VISCOUS, OFFSET, strict=True)
}
MODEL = RobotModel.read(urdf())


@pytest.fixture(scope="module")
def fit():
    return identify_robot(urdf(1.3), log(), validation=log(7))


@pytest.fixture(scope="module")
def alone():
    """Return a fit to one log, with a file whose friction is wrong."""
    return identify_robot(urdf(dynamics='<dynamics damping="9" friction="9"/>'), log())


def moved(seed=5, n=200):
    return waves(seed, np.linspace(0.0, 8.0, n))


def test_the_regressor_predicts_the_torques_of_newton_and_euler():
    q, v, a = MODEL.random_motion(40)
    assert np.allclose(MODEL.torques(q, v, a), newton_euler(q, v, a), atol=1e-12)


def test_branches_and_listed_order_do_not_exchange_joints():
    def limb(name, before, y):
        return (
            f'<link name="{name}_link"><inertial><origin xyz="0.2 {y} 0"/><mass value="{1 + y}"/>'
            '<inertia ixx="0.01" iyy="0.02" izz="0.02" ixy="0" ixz="0" iyz="0"/></inertial></link>'
            f'<joint name="{name}" type="revolute"><parent link="{before}"/>'
            f'<child link="{name}_link"/><origin xyz="0 {y} 0.1"/><axis xyz="0 1 0"/></joint>'
        )

    parts = [limb("z", "base", 0.3), limb("a", "z_link", 0.1), limb("m", "base", -0.2)]
    parts += [limb("b", "m_link", 0.4)]
    found = list[dict[str, float]]()
    for order in (parts, parts[::-1], [parts[k] for k in (2, 0, 3, 1)]):
        model = RobotModel.read(f'<robot name="two"><link name="base"/>{"".join(order)}</robot>')
        place = {name: k for k, name in enumerate(model.names)}
        number = np.array([[float("zamb".index(name) + 1) for name in place]])
        q, v, a = number, 2 * number, 3 * number
        found.append(dict(zip(place, model.torques(q, v, a)[0].tolist(), strict=True)))
    for other in found[1:]:
        assert other == pytest.approx(found[0])
    arm = found[0]
    alone = RobotModel.read(f'<robot name="one"><link name="base"/>{parts[2]}{parts[3]}</robot>')
    q, v, a = (np.array([[i * 3.0, i * 4.0]]) for i in (1, 2, 3))
    torques = dict(zip(alone.names, alone.torques(q, v, a)[0].tolist(), strict=True))
    assert torques == pytest.approx({name: arm[name] for name in ("m", "b")})


def test_base_parameters_determine_all_torques():
    base = base_of(MODEL, rotors=False)
    q, v, a = MODEL.random_motion(30, seed=3)
    columns = MODEL.inertial_columns(q, v, a)
    other = MODEL.pi + np.random.default_rng(0).normal(size=MODEL.pi.size)
    assert np.allclose(columns[..., base.chosen] @ (base.K @ other), columns @ other, atol=1e-9)
    rank = np.linalg.matrix_rank(columns.reshape(-1, columns.shape[2]), tol=1e-9)
    assert len(base.labels) == rank


def test_friction_and_torques_of_another_log_are_found(fit):
    for joint, own in TRUTH.items():
        for name, value in own.items():
            found = fit.friction[joint][name]
            assert abs(found.value - value) < 2 * (found.high - found.low), (joint, name)
    assert max(e.percent for e in fit.validation.values()) < 1.5
    q, v, a = moved()
    truth = newton_euler(q, v, a) + COULOMB * np.sign(v) + VISCOUS * v + OFFSET
    error = (fit.torques(q, v, a) - truth)[np.abs(v).min(axis=1) > 0.02]
    assert np.std(error) < 0.02  # a fifth of the noise of one sample


@pytest.mark.slow
def test_intervals_cover_the_truth_over_seeds_with_coloured_noise_and_an_encoder():
    hits = list[bool]()
    for seed in range(12):
        found = identify_robot(urdf(), log(seed, 5.0, colour=0.7, encoder=1e-5)).friction
        for joint, own in TRUTH.items():
            hits += [found[joint][n].low <= x <= found[joint][n].high for n, x in own.items()]
    assert np.mean(hits) > 0.85, np.mean(hits)


def by_hand(data, weighted):
    """Return friction by least squares on all samples: low pass of 10 Hz, central differences."""
    record, n = data[0], len(NAMES)
    step, inner = record.step, slice(200, -200, 4)
    q = np.column_stack([lowpass(record[name], 10.0, step) for name in NAMES])
    v = np.gradient(q, step, axis=0)
    a = np.gradient(v, step, axis=0)
    q, v, a = (y[inner] for y in (q, v, a))
    columns = MODEL.inertial_columns(q, v, a)
    friction = [y[:, :, None] * np.eye(n) for y in (np.sign(v), v, np.ones_like(v))]
    A = np.concatenate([columns, *friction], axis=2)
    tau = np.column_stack([record[f"{name}_torque"][inner] for name in NAMES])
    w = np.ones(n)
    for _ in range(10 if weighted else 1):
        x = np.linalg.lstsq(
            (A * w[:, None]).reshape(-1, A.shape[2]), (tau * w).ravel(), rcond=1e-10
        )[0]
        w = 1 / np.std(A @ x - tau, axis=0)
    return x[-3 * n :].reshape(3, n)


@pytest.mark.slow
def test_friction_is_at_least_as_good_as_least_squares_by_hand():
    ours, ordinary, weighted = list[float](), list[float](), list[float]()
    truth = np.array([COULOMB, VISCOUS])
    for seed in range(4):
        data = log(seed, 8.0, encoder=1e-4)
        found = identify_robot(urdf(), data).friction
        mine = np.array([[found[j][n].value for j in NAMES] for n in ("mu_d", "sigma_2")])
        for errors, x in (
            (ours, mine),
            (ordinary, by_hand(data, False)[:2]),
            (weighted, by_hand(data, True)[:2]),
        ):
            errors.append(float(np.sqrt(np.mean((x / truth - 1) ** 2))))
    assert np.mean(ours) < np.mean(ordinary)
    assert np.mean(ours) < np.mean(weighted)


def test_inertias_are_consistent_and_stay_near_the_file_where_data_are_silent(fit):
    for row in np.reshape(fit.inertial, (-1, 10)):
        assert np.linalg.eigvalsh(pseudo_inertia(row))[0] > 0
    prior, rows = RobotModel.read(urdf(1.3)).pi.reshape(-1, 10), np.reshape(fit.inertial, (-1, 10))
    assert rows[0, 0] == pytest.approx(prior[0, 0], rel=0.2)  # mass of the first link: no effect
    assert rows[2, 0] == pytest.approx(MODEL.pi[20], rel=0.02)  # mass of the slide: 30 % off before
    q, v, a = moved()
    assert np.std(MODEL.torques(q, v, a, np.array(fit.inertial)) - newton_euler(q, v, a)) < 0.1


def test_the_updated_urdf_has_the_same_torques_and_replaces_friction(alone, tmp_path):
    assert any("URDF is replaced" in text for text in alone.findings)
    path = alone.to_urdf(tmp_path / "new.urdf")
    assert "<!-- kept -->" in path.read_text()
    new, (q, v, a) = RobotModel.read(path), moved()
    assert np.allclose(new.torques(q, v, a), new.torques(q, v, a, np.array(alone.inertial)))
    file = np.array([[joint.friction, joint.damping] for joint in new.joints])
    offset = np.array([alone.offsets[name] for name in NAMES])
    torques = new.torques(q, v, a) + file[:, 0] * np.sign(v) + file[:, 1] * v + offset
    fast = np.abs(v) > 0.05
    assert np.abs(torques - alone.torques(q, v, a))[fast].max() < 1e-6


def test_a_saved_result_predicts_the_same(fit, tmp_path):
    again = load_robot(fit.save(tmp_path / "fit.json"))
    assert np.array_equal(again.torques(*moved()), fit.torques(*moved()))
    assert str(again) == str(fit)
    (tmp_path / "other.json").write_text("{}")
    with pytest.raises(ValueError, match="got another file"):
        load_robot(tmp_path / "other.json")


def test_the_table_and_the_figure_show_every_joint(fit, tmp_path):
    lines = str(fit).splitlines()
    assert all(any(line.startswith(name) for line in lines) for name in NAMES)
    assert len(fit.plot(tmp_path / "fit.png").axes) == 2 * len(NAMES)
    assert (tmp_path / "fit.png").stat().st_size > 1000


@pytest.mark.parametrize("noise", sampled([1e-8, 0.0, 1e-6], of=3))
def test_a_resting_joint_is_named_and_costs_only_its_own_rows(noise):
    t = np.arange(2500) / 250.0
    q, v, a = waves(0, t)
    q[:, 2], v[:, 2], a[:, 2] = 0.2, 0.0, 0.0
    rng = np.random.default_rng(1)
    tau = (
        newton_euler(q, v, a) + COULOMB * np.sign(v) + VISCOUS * v + 0.05 * rng.normal(size=q.shape)
    )
    slide = q[:, 2] + noise * rng.normal(size=t.size)
    data = log(slide=slide, **{f"{n}_torque": y for n, y in zip(NAMES, tau.T, strict=True)})
    seen = robot_information(urdf(), data)
    assert seen.resting == ("slide",)
    assert seen.rank < seen.total
    assert any("To see them, move" in s and "slide" in s for s in seen.sentences)
    found = identify_robot(urdf(), data)
    assert "slide" not in found.friction
    assert found.friction["elbow"]["mu_d"].value == pytest.approx(COULOMB[1], rel=0.05)
    assert all(np.abs(one.predicted).max() < 5 * np.abs(tau).max() for one in found.series)


def test_what_is_said_about_parameters_holds_for_short_and_small_motions():
    base, t = base_of(MODEL, rotors=False), np.arange(1500) / 250.0
    q, v, a = waves(4, t, 0.02)
    tau = newton_euler(q, v, a) + COULOMB * np.sign(v) + VISCOUS * v
    tau += 0.1 * np.random.default_rng(0).normal(size=q.shape)
    small = dict(zip(NAMES, q.T, strict=True))
    small |= {f"{n}_torque": y for n, y in zip(NAMES, tau.T, strict=True)}
    for data in (log(4, 6.0, **small), *(log(seed, 1.5) for seed in range(3))):
        found = identify_robot(urdf(1.3), data)
        loose = np.array([label in found.information.undetermined for label in base.labels])
        x = np.array([found.base[label].value for label in base.labels])
        assert 0 < loose.sum() <= loose.size
        assert found.information.rank < found.information.total
        assert np.all(np.abs(x - base.values)[~loose] < base.scales[~loose])
        near = base.K @ np.array(found.inertial) - 1.3 * base.values
        assert np.all(np.abs(near)[loose] < base.scales[loose])


def test_motion_in_one_direction_has_a_sentence_and_no_levels():
    data = log(1, 5.0, rate=1000.0).between(3.0, 3.5)
    v = np.diff([data[0][name] for name in NAMES], axis=1)
    assert np.all(np.abs(np.sign(v).sum(axis=1)) == v.shape[1])
    seen = robot_information(urdf(), data)
    assert any(f"offset of {', '.join(NAMES)} are not separable" in s for s in seen.sentences)
    found = identify_robot(urdf(), data).friction
    assert all(own[key].low is None for own in found.values() for key in ("mu_d", "offset"))


def test_only_rows_of_the_reversing_joint_are_left_out(fit):
    parts = {one.joint: one.used for one in fit.series}
    assert all(np.mean(used) > 0.6 for used in parts.values())
    assert any(np.any(parts["shoulder"] != parts[name]) for name in NAMES[1:])


def test_logs_of_different_rates_and_units_are_fitted_together(alone):
    slow = log(3, rate=100.0)[0]
    header = {
        f"{n} [{'mm' if n == 'slide' else 'deg'}]": slow[n] * (1e3 if n == "slide" else 180 / np.pi)
        for n in NAMES
    }
    units = ("N m", "N m", "N")
    torques = {f"{n}_torque [{u}]": slow[f"{n}_torque"] for n, u in zip(NAMES, units, strict=True)}
    other = Dataset.of({"t [s]": slow.time, **header, **torques})
    both = identify_robot(urdf(), log() + other)
    for joint, own in TRUTH.items():
        found, before = both.friction[joint]["sigma_2"], alone.friction[joint]["sigma_2"]
        assert abs(found.value - own["sigma_2"]) < 2 * (found.high - found.low)
        assert found.high - found.low < before.high - before.low


def test_rotor_inertias_are_found_where_they_are_separable():
    t = np.arange(2500) / 250.0
    force = log()[0]["slide_torque"] + 10.0 * waves(0, t)[2][:, 2]
    data = log(slide_torque=force)
    plain, found = (identify_robot(urdf(), data, rotors=rotors) for rotors in (False, True))
    assert found.rotors["slide"] == pytest.approx(10.0, rel=0.05)
    assert any("pass rotors=True" in text for text in plain.findings)
    assert not found.findings
    assert found.training["slide"].rms < 0.8 * plain.training["slide"].rms
    torques = found.torques(*waves(5, t))
    rigid = newton_euler(*waves(5, t)) + 10.0 * waves(5, t)[2] * np.array([0, 0, 1])
    v = waves(5, t)[1]
    error = torques - rigid - COULOMB * np.sign(v) - VISCOUS * v - OFFSET
    assert np.sqrt(np.mean(error[np.abs(v).min(axis=1) > 0.02] ** 2)) < 0.05


@pytest.mark.parametrize("method", ["ordinary", "robust"])
def test_other_weights(method):
    torque = log()[0]["elbow_torque"].copy()
    torque[::400] += 50.0
    found = identify_robot(urdf(), log(elbow_torque=torque), method=method)
    error = abs(found.friction["elbow"]["mu_d"].value - COULOMB[1])
    assert (error < 0.02) == (method == "robust"), error


def test_a_nonlinear_law_is_fitted_with_the_inertias():
    t = np.arange(2500) / 250.0
    v = waves(0, t)[1][:, 0]
    torque = log()[0]["shoulder_torque"] + 1.5 * np.exp(-((v / 0.5) ** 2)) * np.sign(v)
    data = log(shoulder_torque=torque)
    found = identify_robot(urdf(), data, {"shoulder": "stribeck"}).friction["shoulder"]
    assert found["mu_s"].value == pytest.approx(2.7, abs=0.1)
    assert found["mu_d"].value == pytest.approx(1.2, abs=0.1)
    assert found["v_s"].value == pytest.approx(0.5, abs=0.1)


@pytest.mark.parametrize("joint", NAMES[:2])
def test_of_two_joints_the_one_with_the_other_sign_is_named(joint):
    two = urdf().replace('type="prismatic"', 'type="fixed"')
    t = np.arange(1500) / 250.0
    q, v, a = (y[:, :2] for y in waves(0, t))
    tau = RobotModel.read(two).torques(q, v, a) + COULOMB[:2] * np.sign(v) + VISCOUS[:2] * v
    tau += 0.05 * np.random.default_rng(0).normal(size=q.shape)
    tau[:, NAMES.index(joint)] *= -1
    columns = {name: q[:, k] for k, name in enumerate(NAMES[:2])}
    columns |= {f"{name}_torque": tau[:, k] for k, name in enumerate(NAMES[:2])}
    units = {name: "N m" if "torque" in name else "rad" for name in columns}
    with pytest.raises(ValueError, match=f"got that of {joint} with the other sign"):
        identify_robot(two, Dataset.of({"t": t, **columns}, units=units))


def test_torques_of_other_shapes_are_refused(fit):
    for shape, got in (((5, 2), r"\(5, 2\), \(5, 2\) and \(5, 2\)"), ((3,), r"\(3,\)")):
        with pytest.raises(ValueError, match=rf"shape \(N, 3\), got {got}"):
            fit.torques(*np.zeros((3, *shape)))


def test_friction_over_time_feeds_a_fit_of_any_law(fit):
    data = fit.friction_data("elbow")
    v, F = data[0]["v"], data[0]["F"]
    fast = np.abs(v) > 0.3
    expected = COULOMB[1] * np.sign(v) + VISCOUS[1] * v + OFFSET[1]
    assert np.sqrt(np.mean((F - expected)[fast] ** 2)) < 0.15
