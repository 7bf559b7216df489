"""Check that ADAMS models rebuilt from the exported text have the masses, forces and walk of our walker."""

import re

import numpy as np
import pytest
from adams_dataset import Dataset, HaltError, rotation
from exported_walkers import (
    LIMPING,
    ONE_KNEE,
    PADS,
    PARTS,
    export_of,
    files_of,
    random_kneed_walker,
    random_walker,
    run_kneed,
    touches_of,
    with_gait,
)

from walkerlab.errors import ConfigError
from walkerlab.exchange.export import export_model
from walkerlab.physics.ground.external import feet_and_forces
from walkerlab.physics.ground.walker import new_progress, place_on_ground

MM = 1000.0
STOPS = ((), ("walker.knee.lock=compliant",))
WALKERS = ["compass", "round-feet", "torso", "push-off", "hip-torque"]


def dataset_of(law, name, *sets):
    return Dataset(next(iter(files_of("adm", law, name, *sets).files.values())))


def hung(dataset, q, v):
    """Return coordinates and velocities of all parts, given those of a tree: position of the base (m), then relative
    angles.
    """
    pose, rates = np.zeros(3 * len(dataset.parts)), np.zeros(3 * len(dataset.parts))
    number = 2
    for joint in dataset.of("JOINT"):
        i, j = joint.marker("I"), joint.marker("J")
        marker = dataset.markers[i]
        at, turn, moving, spin = MM * q[:2], 0.0, MM * v[:2], 0.0
        if "PLANAR" not in joint.flags:
            (at, turn), (moving, spin) = dataset.place(pose, j), dataset.velocity(pose, rates, j)
        turn, spin = turn + q[number], spin + v[number]
        lever = rotation(turn) @ marker.place
        own = slice(dataset.index[marker.part], dataset.index[marker.part] + 3)
        pose[own] = [*(at - lever), turn]
        rates[own] = [*(moving - spin * np.array([-lever[1], lever[0]])), spin]
        number += 1
    return pose, rates


def without_forces(dataset):
    dataset.forces, dataset.reactions, dataset.single = [], [], []
    return dataset


def directions(dataset, q):
    """Return the matrix that maps the velocities of the tree to those of the parts, (velocities of parts, velocities of
    the tree).
    """
    return np.column_stack([hung(dataset, q, unit)[1] for unit in np.eye(q.size)])


def mass_of_tree(scene, q):
    """Return our mass matrix in the coordinates of the tree, from the constants of the equations of motion."""
    whole, chain = scene.ours.whole, scene.model.chain
    n = len(chain)
    columns = np.column_stack([np.array(scene.about_centre(q, unit))[2 + n :] for unit in np.eye(q.size)])
    angles = chain @ q[2:]
    delta = angles[None, :] - angles[:, None]
    mass = np.zeros((2 + n, 2 + n))
    mass[:2, :2] = whole.mass * np.eye(2)
    mass[2:, 2:] = whole.A[:n, :n] * np.cos(delta) + whole.B[:n, :n] * np.sin(delta)
    return columns.T @ mass @ columns, columns


def random_states(export, count=5):
    """Yield random states near the start with both feet some millimetres inside their pads."""
    draw = np.random.default_rng(1)
    q, v = export.start
    for _ in range(count):
        near = q + 1e-4 * draw.standard_normal(q.size)
        near[1] -= draw.uniform(2e-3, 1e-2)
        yield near, v + 0.3 * draw.standard_normal(v.size)


@pytest.mark.parametrize("seed", range(len(WALKERS)), ids=WALKERS)
def test_exported_masses_and_gravity_match_the_model(seed):
    walker = random_walker(seed)
    dataset, export = without_forces(dataset_of("functions", *walker)), export_of(*walker)
    for q, _ in random_states(export):
        ways = directions(dataset, q)
        pose, rest = hung(dataset, q, np.zeros(q.size))
        mass, columns = mass_of_tree(export.scene, q)
        scale = np.sqrt(np.diag(mass))
        in_tree = ways.T @ dataset.mass(pose) @ ways / MM**2
        assert np.abs((in_tree - mass) / np.outer(scale, scale)).max() < 1e-12
        weight = export.scene.ours.mass * np.array(export.scene.gravity) * [1.0, -1.0]
        ours = columns[:2].T @ weight
        theirs = ways.T @ dataset.applied(0.0, pose, rest) / MM**2
        assert np.abs(theirs - ours).max() < 1e-12 * np.abs(ours).max()


@pytest.mark.parametrize("law", ["contact.full_damping_penetration=20", "contact.exponent=1.0"])
@pytest.mark.parametrize("seed", range(len(WALKERS)), ids=WALKERS)
def test_exported_forces_equal_those_of_the_model(seed, law):
    walker = (*random_walker(seed), law)
    dataset, export = dataset_of("functions", *walker), export_of(*walker)
    without = without_forces(dataset_of("functions", *walker))
    # The other foot has just touched, so its leg is the stance leg and the trailing foot is pushed.
    touch = export.touches_s[0]
    time = touch + 0.3 * export.config.push_off.duration_s
    system = place_on_ground(export.scene.walker, (True, True), progress=new_progress(0, 1, touch))
    for q, v in random_states(export):
        ours, feet = np.zeros(q.size), np.zeros((2, 4))
        feet_and_forces(system, export.model.chain, time, q, v, feet, ours)
        assert feet[:, 1].max() < -1e-3
        state = hung(dataset, q, v)
        theirs = dataset.applied(time, *state) - without.applied(time, *state)
        theirs = directions(dataset, q).T @ theirs / MM**2
        # A penetration is the difference of two rounded heights of a metre.
        rounding = 4.0 * np.finfo(float).eps * 2.2 / np.abs(feet[:, 1]).min()
        assert np.abs(theirs - ours).max() < (1e-12 + rounding) * np.abs(ours).max()


@pytest.mark.parametrize("seed", range(3), ids=WALKERS[:3])
def test_exported_model_reproduces_the_walk(seed):
    walker = random_walker(seed)
    dataset, export = dataset_of("functions", *walker), export_of(*walker)
    assert export.walk.steps >= 3
    expected = np.array(export.touches_s[:3])
    assert touches_of(dataset, export, 3)[:3] == pytest.approx(expected, abs=1e-6)


@pytest.mark.parametrize("walker", LIMPING[:3], ids=lambda walker: walker[0])
def test_exported_model_of_legs_that_differ_reproduces_the_walk(walker):
    """The fourth kind has knees, and another test covers it."""
    dataset, export = dataset_of("functions", *walker), export_of(*walker)
    assert export.walk.steps == 4
    expected = np.array(export.touches_s[:3])
    assert touches_of(dataset, export, 3)[:3] == pytest.approx(expected, abs=1e-6)


def test_pads_of_legs_that_differ_lie_under_their_footholds():
    """Leg 1 takes longer steps than leg 2."""
    dataset, export = dataset_of("contact", *LIMPING[0]), export_of(*LIMPING[0])
    pitch = export.scene.ground.terrain.pitch
    boxes = [s for s in dataset.of("GRAPHICS") if "BOX" in s.flags]
    corners = {s.id: s.numbers("QP", (0.0, 0.0, 0.0)) for s in dataset.of("MARKER")}
    edges = [corners[box.marker("CORNER")] for box in boxes]
    lanes = [sorted(x for x, _, z in edges if (z < 0.0) == stands) for stands in (False, True)]
    gaps = [np.diff(lane) for lane in lanes]
    assert np.concatenate(gaps) == pytest.approx(2.0 * MM * pitch)
    share = with_gait(*LIMPING[0])[1].asymmetry
    first, second = MM * pitch * np.array([1.0 - 0.5 * share, 1.0 + 0.5 * share])
    ahead = min(x for x in lanes[0] if x > lanes[1][1]) - lanes[1][1]
    assert ahead == pytest.approx(first)
    assert min(x for x in lanes[1] if x > lanes[0][1]) - lanes[0][1] == pytest.approx(second)


@pytest.mark.parametrize("walker", [LIMPING[3], ONE_KNEE], ids=["two knees", "one knee"])
def test_adams_commands_lock_the_knees_of_unequal_legs_at_the_right_times(walker):
    """The knees have dampers as well."""
    touches, locks, walk = run_kneed(*walker)
    assert touches == pytest.approx(walk.touch_time_s, abs=1e-6)
    strikes = walk.knee_strike_time_s
    assert locks == pytest.approx(strikes[strikes > 0.0], abs=1e-6)


@pytest.mark.parametrize("seed", [0, 2], ids=["ideal lock", "push-off"])
def test_adams_commands_lock_and_release_knees_at_sensors_and_reproduce_our_walk(seed):
    """A script runs ten walkers of five kinds for three strides."""
    touches, locks, walk = run_kneed(*random_kneed_walker(seed, 1))
    assert touches == pytest.approx(walk.touch_time_s, abs=1e-6)
    assert locks == pytest.approx(walk.knee_strike_time_s, abs=1e-6)


@pytest.mark.parametrize(("slower", "sensor"), [(0.5, "fell"), (0.8, "leg_2_on_bent_knee")])
def test_adams_run_halts_at_the_sensor_for_the_end_of_the_walk(slower, sensor):
    dataset, commands = files_of("adm", "functions", "kneed", "strides=1").files.values()
    model = Dataset(dataset)
    q, u = model.start
    model.start = q, slower * u
    with pytest.raises(HaltError, match=f"^{sensor} at"):
        model.run(commands)


def test_ideal_knee_lock_is_exported_to_adams_as_a_stop():
    ideal, compliant = (files_of("adm", "functions", "kneed", "strides=1", *sets) for sets in STOPS)
    assert any("plastic impact" in item for item in ideal.left_out)
    assert not any("plastic impact" in item for item in compliant.left_out)
    ideal_text, compliant_text = (
        re.sub(r"(?m)^! .*\n", "", next(iter(each.files.values()))) for each in (ideal, compliant)
    )
    assert ideal_text == compliant_text


def test_adams_view_script_has_the_commands_of_the_command_file():
    _, commands = files_of("adm", "functions", "kneed", "strides=1").files.values()
    text = files_of("cmd", "functions", "kneed", "strides=1").files["kneed.cmd"]
    script = re.sub(r"\s*&\n\s*", " ", text).splitlines()[-1]
    quoted = re.findall(r'"(.+?)"', script)
    assert quoted == [line for line in commands.splitlines()[3:] if line != "stop"]
    dataset = dataset_of("functions", "kneed", "strides=1")
    in_order = re.findall(r"sensor_name = \.kneed\.(\w+)\s*&\s*adams_id = (\d+)", text)
    assert {int(number): name for name, number in in_order} == {
        number: sensor.label for number, sensor in dataset.sensors.items()
    }


def test_exported_adams_model_has_no_redundant_constraint():
    assert dataset_of("functions", "paper").degrees_of_freedom() == 4
    torso = dataset_of("functions", "torso", PADS)
    assert torso.degrees_of_freedom() == 4
    g, _ = torso.constraints(*torso.start)
    assert np.linalg.matrix_rank(g / np.linalg.norm(g, axis=1)[:, None]) == len(g)
    assert np.abs(g @ torso.start[1]).max() < 1e-9


def test_contacts_have_the_adams_parameters_and_pads_lie_in_two_lanes():
    dataset = dataset_of("contact", "paper")
    shapes = {s.id: s for s in dataset.of("GRAPHICS")}
    corners = {s.id: s.numbers("QP", (0.0, 0.0, 0.0)) for s in dataset.of("MARKER")}
    lanes = []
    for contact in dataset.of("CONTACT"):
        numbers = {key: contact.numbers(key)[0] for key in ("STIFFNESS", "DAMPING", "DMAX", "EXPONENT")}
        assert numbers == pytest.approx({"STIFFNESS": 1e5, "DAMPING": 90.0, "DMAX": 0.1, "EXPONENT": 2.2})
        friction = [contact.numbers(key)[0] for key in ("MU_STATIC", "MU_DYNAMIC", "STICTION_TRANSITION_VELOCITY")]
        assert friction == pytest.approx([0.9, 0.7, 100.0])
        ball = shapes[contact.marker("IGEOM")]
        assert "ELLIPSOID" in ball.flags
        assert ball.numbers("XSCALE") == pytest.approx((2.0,))
        pads = [shapes[int(identity)] for identity in contact.numbers("JGEOM")]
        across = corners[ball.marker("CM")][2]
        for pad in pads:
            x, y, z = corners[pad.marker("CORNER")]
            assert y + pad.numbers("Y")[0] == pytest.approx(0.0)
            assert z < across < z + pad.numbers("Z")[0]
            lanes.append((x, z))
    assert len({z for _, z in lanes}) == 2
    assert len(lanes) == len(set(lanes)) == 17


def test_adams_result_names_match_recording_columns():
    from walkerlab.exchange.columns import Recording, match_columns

    text = next(iter(files_of("adm", "contact", "torso", PADS).files.values()))
    names = [
        f"{name}.{component}"
        for name, components in re.findall(r"RESULTS_NAME = (\w+)\n, CNAMES = (.*)", text)
        for component in re.findall(r'"(\w+)"', components)
    ]
    found, ambiguous = match_columns(Recording("a.res", dict.fromkeys(names, np.zeros(2))), {"time"})
    assert not ambiguous
    assert set(found.values()) == set(names)
    assert found["angle 1"] == "leg_1.angle"
    assert found["foot_along_m 2"] == "leg_2.foot_along"
    assert found["torso_velocity"] == "walker.torso_velocity"


def test_commands_simulate_a_pinned_first_step_and_then_release_the_foot():
    exported = files_of("adm", "functions", "paper", "contact.stance=pinned")
    dataset, commands = (text.splitlines() for text in exported.files.values())
    first = export_of("paper", "contact.stance=pinned").touches_s[0]
    assert commands[0] == "paper.adm"
    assert f"simulate/dynamic, end = {first!r}, dtout = 0.001" in commands
    assert commands[commands.index("deactivate/jprim, id = 1") + 1].startswith("simulate/dynamic")
    assert "JPRIM/1" in dataset
    assert export_of("paper").pinned is False


def test_header_states_origin_and_omissions_of_the_model():
    exported = files_of("adm", "functions", "level")
    text = next(iter(exported.files.values()))
    assert text.startswith("walkerlab model of level\n! Written by walkerlab ")
    assert "! Config: level." in text
    assert exported.left_out
    assert all(f"! Left out: {item}" in text for item in exported.left_out)
    assert any("open-loop" in item for item in exported.left_out)


def test_bodies_keep_readable_names(tmp_path):
    path = tmp_path / "parts.yaml"
    path.write_text(PARTS)
    text = next(iter(files_of("adm", "functions", str(path)).files.values()))
    dataset = Dataset(text)
    assert [part.label for part in dataset.parts.values()] == ["right_leg", "left_leg"]
    assert text.startswith("walkerlab model of compass_by_parts\n")


@pytest.mark.parametrize(
    ("law", "walker", "why", "instead"),
    [
        ("contact", ("paper", "contact.exponent=1.0"), "exponent above 1", "functions"),
        ("contact", ("paper", "contact.dynamic_friction=0.9"), "static friction above dynamic", "functions"),
        ("contact", ("paper", "contact.damping=0"), "damping above 0", "functions"),
        ("functions", ("round-feet",), "only after mid-swing", "checkerboard"),
        ("functions", ("simplest",), "next to no mass", "mass"),
        ("functions", ("paper", "ground.roughness_m=0.0005"), "uneven ground", "--law contact"),
    ],
)
def test_unsupported_features_are_rejected(law, walker, why, instead):
    with pytest.raises(ConfigError) as caught:
        export_model(*with_gait(*walker), "adm", law)
    assert why in caught.value.message
    assert instead in caught.value.advice


def test_uneven_pads_are_exported_as_boxes():
    sets = ("ground.heights_m=[0.001,-0.002]", "strides=2")
    dataset = dataset_of("contact", "paper", *sets)
    tops = {s.label: s.numbers("QP")[1] + 50.0 for s in dataset.of("MARKER") if s.label.startswith("pad_")}
    # The first pad is two pads behind that of the start.
    assert [tops[f"pad_{number}"] for number in range(1, 7)] == pytest.approx([0.0, 0.0, 0.0, 1.0, -2.0, -2.0])


def test_commands_for_adams_view_build_the_same_objects():
    walker = ("torso", PADS, "walker.hip.spring_N_m_per_rad=1")
    for law in ("contact", "functions"):
        dataset = dataset_of(law, *walker)
        text = files_of("cmd", law, *walker).files["torso.cmd"]
        commands = re.sub(r"\s*&\n\s*", " ", text).splitlines()
        assert commands[0] == "! CMD Version:2"
        masses = [float(mass) for mass in re.findall(r" mass = (\d\S*)", text)]
        assert masses == [part.mass for part in dataset.parts.values()]
        spins = [float(found) for found in re.findall(r"wz = \((\S+)\(rad/sec\)\)", text)]
        assert spins == [part.velocity[2] for part in dataset.parts.values()]
        defined = set(re.findall(r"_name = \.torso\.([\w.]+)", text)) | {"ground"}
        assert set(re.findall(r"\.torso\.([\w.]+)", text)) <= defined
        functions = re.findall(r'function = "(.+?)"', text)
        assert all(function.count("(") == function.count(")") for function in functions)
        assert "{" not in text
