"""Tests of the stage `identify`: recovered parameters, recognised misfits, and rejected requests."""

import json
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

from walkerlab.config.loader import load
from walkerlab.config.reads import restrict
from walkerlab.errors import ConfigError, NoAnswer
from walkerlab.pipeline.plan.graph import PIPELINE
from walkerlab.pipeline.plan.results import Keys
from walkerlab.pipeline.progress import Silent
from walkerlab.pipeline.stages import fixedpoint, identify, simulate
from walkerlab.pipeline.stages.measured_walk import NO_FILE, MeasuredFile, digests
from walkerlab.views.cli.main import program
from walkerlab.views.figures.stage import FIGURES
from walkerlab.views.report.answers import answer
from walkerlab.views.report.blocks import Player, Results
from walkerlab.views.report.sections.identification import section
from walkerlab.views.report.tables import Table

# The interface of `--json` fixes these keys. The command line adds `config`.
FIXED_KEYS = {
    "estimates", "not_identifiable", "correlations", "singular_values", "steps", "rms_residual", "chi_square_per_dof",
    "noise", "gait", "models",
}  # fmt: skip
NOISE = 1e-3
START = "start=[-0.20477, 0.17, -0.35, -0.9]"
GOOD = "period_s,length_m\n" + "".join(f"0.7{k},0.37{k}\n" for k in range(8))


def taken(*changes):
    return restrict(load(Path("paper"), changes).config, PIPELINE["identify"].takes)


@pytest.fixture(scope="module")
def gait():
    config = load(Path("paper"), ()).config
    return {"fixedpoint": fixedpoint.run(restrict(config, PIPELINE["fixedpoint"].takes), {}, Silent())}


@pytest.fixture(scope="module")
def transient(gait):
    config = load(Path("paper"), (START, "strides=10")).config
    return simulate.run(restrict(config, PIPELINE["simulate"].takes), gait, Silent())


@pytest.fixture(scope="module")
def table(transient, tmp_path_factory):
    """Write the steps of a transient with noise of 1 ms and 1 mm."""
    rng, steps = np.random.default_rng(4), transient.groups["steps"]
    values = np.column_stack((steps["period_s"], steps["length_m"]))
    path = tmp_path_factory.mktemp("walk") / "steps.csv"
    rows = (f"{period:.9f},{length:.9f}" for period, length in values + NOISE * rng.standard_normal(values.shape))
    path.write_text("\n".join(("period_s,length_m", *rows)))
    return path


def ask(data, *changes):
    return (f"identify.data={json.dumps(str(data))}", *changes)


@pytest.fixture(scope="module")
def identified(table, gait):
    fit = "identify.fit={slope_deg: null, walker.hip_mass_kg: [5, 20]}"
    return identify.run(taken(*ask(table, fit, "walker.hip_mass_kg=9")), gait, Silent())


def test_parameters_of_a_noisy_transient_are_recovered_within_error_bars(identified):
    truth = load(Path("paper"), ()).config
    values = {row["key"]: row for row in identified.summary["estimates"]}
    for key, value in (("slope_deg", np.degrees(truth.slope_rad)), ("walker.hip_mass_kg", truth.walker.hip_mass_kg)):
        assert abs(values[key]["value"] - value) < 4.0 * values[key]["standard_error"], key
    assert values["walker.hip_mass_kg"]["start"] == 9.0
    assert not values["walker.hip_mass_kg"]["at_bound"]


def test_summary_has_the_expected_keys_and_is_json(identified):
    summary = identified.summary
    assert set(summary) >= FIXED_KEYS
    json.dumps(summary, allow_nan=False)
    assert set(summary["estimates"][0]) == {"key", "value", "standard_error", "unit", "start", "at_bound"}
    assert set(summary["gait"]) == {"period_s", "step_length_m", "spectral_radius"}
    assert all(set(value) == {"value", "standard_error"} for value in summary["gait"].values())
    process = summary["noise"]["process"]
    assert {"roughness_m", "share_of_leg", "standard_error", "at_bound"} < set(process)
    assert process["kick"] >= 0.0
    assert summary["models"][0]["fit"] == "fits"
    assert summary["steps"] == 20
    assert np.allclose(np.diag(summary["correlations"]["matrix"]), 1.0)


def test_answer_states_masses_in_plain_words(identified):
    text = " ".join(" ".join(answer("identify", identified.summary)).split())
    assert "The hip weighs " in text
    assert " kg if the legs weigh 5 kg each" in text
    assert "each; the slope is " in text
    assert " degrees" in text


def test_stored_steps_equal_those_of_the_file(identified, table):
    columns = np.loadtxt(table, delimiter=",", skiprows=1).T
    steps = identified.groups["steps"]
    assert np.allclose(steps["measured_step_period_s"], columns[0], rtol=1e-12)
    residual = steps["measured_step_length_m"] - steps["predicted_step_length_m"]
    assert 0.3 * NOISE < residual.std() < 3.0 * NOISE


def test_every_figure_of_an_identification_is_drawn(identified):
    figures = [figure for figure in FIGURES if figure.stages == ("identify",)]
    results = {"identify": identified}
    assert [figure.why_left_out(results, {}) for figure in figures] == [None] * 4
    for figure in figures:
        drawing = figure.render(results)
        assert drawing.caption
        assert drawing.png.startswith(b"\x89PNG")


def test_two_masses_of_a_rigid_walk_are_reported_as_one_combination(table, gait):
    changes = ask(table, "identify.fit={walker.leg_mass_kg: null, walker.hip_mass_kg: null}")
    summary = identify.run(taken(*changes), gait, Silent()).summary
    assert [row["standard_error"] for row in summary["estimates"]] == [None, None]
    assert len(summary["not_identifiable"]) == 1
    text = " ".join(" ".join(answer("identify", summary)).split())
    assert "Leg mass and hip mass cannot be separated by this walk. They can change together" in text
    combination = text.partition("with weights: ")[2].partition(";")[0]
    assert "leg mass (" in combination
    assert "hip mass (" in combination
    assert "No walk would separate them; a value known beforehand (--prior) would." in text


def test_known_leg_mass_determines_the_hip_mass(table, gait):
    fit = "identify.fit={walker.leg_mass_kg: null, walker.hip_mass_kg: null}"
    changes = ask(table, fit, "identify.prior={walker.leg_mass_kg: [5, 0.05]}")
    rows = {row["key"]: row for row in identify.run(taken(*changes), gait, Silent()).summary["estimates"]}
    assert rows["walker.leg_mass_kg"]["standard_error"] == pytest.approx(0.05, rel=0.02)
    # The ratio of hip and leg is known far better than the leg, so the hip has the relative error of the leg.
    assert rows["walker.hip_mass_kg"]["standard_error"] == pytest.approx(0.1, rel=0.1)


def test_fit_to_millimetres_read_as_metres_is_reported_as_a_misfit(table, gait, tmp_path):
    rows = np.loadtxt(table, delimiter=",", skiprows=1) * (1.0, 1e3)
    path = tmp_path / "mm.csv"
    path.write_text("period_s,length_m\n" + "\n".join(f"{p},{q}" for p, q in rows))
    summary = identify.run(taken(*ask(path, "identify.fit={slope_deg: null}")), gait, Silent()).summary
    assert summary["models"][0]["fit"] == "misfit"
    assert "explains this walk" in " ".join(" ".join(answer("identify", summary)).split())


def test_columns_and_units_are_mapped(table, tmp_path):
    rows = np.loadtxt(table, delimiter=",", skiprows=1) * 1e3
    path = tmp_path / "mapped.csv"
    path.write_text("T,stride [mm]\n" + "\n".join(f"{p},{q}" for p, q in rows))
    columns = 'identify.columns={period_s: T, length_m: "stride"}'
    changes = ask(path, "identify.fit={slope_deg: null}", columns, "identify.units={period_s: ms}")
    config = taken(*changes)
    steps = next(MeasuredFile(config.identify, config).divisions())
    assert np.allclose(np.column_stack((steps.periods_s, steps.lengths_m)), 1e-3 * rows)


def test_changing_the_file_changes_the_result_key(tmp_path):
    path = tmp_path / "steps.csv"
    config = load(Path("paper"), ask(path, "identify.fit={slope_deg: null}")).config
    assert digests(config) == {"identify.data": NO_FILE}
    keys = []
    for text in (GOOD, GOOD.replace("0.373", "0.372"), GOOD):
        path.write_text(text)
        keys.append(Keys().compute_keys(config, "identify")["identify"])
    assert keys[0] == keys[2] != keys[1]


def test_sampled_angles_are_divided_at_their_heel_strikes(transient, tmp_path):
    samples = transient.groups["trajectory"]
    time, angle, path = samples["time"], samples["angle"], tmp_path / "angles.csv"
    # Rounding decides whether the last touch is in the data, so leave out its step.
    touches = transient.groups["steps"]["touch_time_s"]
    rising = np.append(True, np.diff(time) > 0.0) & (time < 0.5 * (touches[-2] + touches[-1]))
    lines = (f"{t!r},{a!r},{b!r}" for t, (a, b) in zip(time[rising].tolist(), angle[rising].tolist(), strict=True))
    path.write_text("time (s),angle 1 (rad),angle 2 (rad)\n" + "\n".join(lines))
    config = taken(*ask(path, "identify.level=angles", "identify.fit={slope_deg: null}"))
    measured = next(MeasuredFile(config.identify, config).divisions())
    expected = transient.groups["steps"]["period_s"][:-1][-measured.count :]
    assert measured.count >= 18
    assert np.allclose(measured.periods_s, expected, atol=2e-4)
    assert 0.0 <= measured.phase.min() <= measured.phase.max() < 1.0


FIT = ("--fit", "slope_deg")
DAMAGED_OPTIONS = [
    (), ("--fit", "slope"), ("--fit", "walker"), ("--fit", "walker.hip_mas_kg"), ("--fit", "name"), ("--fit", "seed"),
    ("--fit", "walker.thigh.mass_kg"), ("--fit", "contact.damping"), ("--fit", "walker.hip_mass_kg=5"),
    ("--fit", "walker.hip_mass_kg=5:"), ("--fit", "walker.hip_mass_kg=:5"), ("--fit", "walker.hip_mass_kg=20:5"),
    ("--fit", "walker.hip_mass_kg=5:5"), ("--fit", "walker.hip_mass_kg=a:b"), ("--fit", "walker.hip_mass_kg=-1:20"),
    ("--fit", "walker.hip_mass_kg=nan:20"), ("--fit", "walker.hip_mass_kg=5:inf"), ("--fit", "=5:20"), ("--fit", ""),
    ("--fit", "walker.hip_mass_kg=11:20"), ("--fit", "slope_deg=-95:5"), ("--fit", "slope_deg: [1"), ("--fit", "[=1:2"),
    (*FIT, "--prior", "walker.hip_mass_kg"), (*FIT, "--prior", "walker.hip_mass_kg=10"), (*FIT, "--prior", "10:1"),
    (*FIT, "--prior", "walker.hip_mass_kg=10:0"), (*FIT, "--prior", "walker.hip_mass_kg=10:-1"),
    (*FIT, "--prior", "walker.hip_mass_kg=-10:1"), (*FIT, "--prior", "hip=10:1"),
    (*FIT, "--prior", "walker.hip_mass_kg=x:1"), (*FIT, "--prior", "walker.hip_mass_kg=10:nan"),
    (*FIT, "--prior", "walker.hip_mass_kg=10:1e-300"), (*FIT, "--prior", "slope_deg=3:1e-10"),
    (*FIT, "--nuisance", "clock"), (*FIT, "--nuisance", "clock_rate"), (*FIT, "--nuisance", ""),
    (*FIT, "--model", "elastic"), (*FIT, "--model", "contact", "--set", "contact=null"),
    (*FIT, "--level", "strides"), (*FIT, "--level", "angles"), (*FIT, "--loss", "huber"),
    (*FIT, "--columns", "period_s"), (*FIT, "--columns", "period=T"), (*FIT, "--columns", "period_s=T"),
    (*FIT, "--columns", "length_m=step"), (*FIT, "--units", "furlong"), (*FIT, "--units", "length=furlong"),
    ("--set", "identify.fit=3"), (*FIT, "--set", "identify.date=steps.csv"), (*FIT, "--set", "identify=3"),
]  # fmt: skip
HEAD = "period_s,length_m\n"
DAMAGED_FILES = [
    b"", b"\n\n", b"\0\1\2\3", HEAD.encode(), f"{HEAD}0.7,0.37\n".encode(), b"0.7,0.37\n0.7,0.37\n",
    f"{HEAD}0.7,0.37\n0.7\n".encode(), f"{HEAD}0.7,0.37\n0.7,0.37,1\n".encode(), f"{HEAD}0.7,0.37\n,0.37\n".encode(),
    f"{HEAD}0.7,0.37\n0.7,nan\n".encode(), f"{HEAD}0.7,0.37\nabc,0.37\n".encode(),
    f"{HEAD}0.7,0.37\n-0.7,0.4\n".encode(), f"{HEAD}7e300,3e300\n6e300,3e300\n".encode(),
    f"{HEAD}1e-300,1e-300\n1e-300,1e-300\n".encode(), b"period_s,touch_angle_rad\n0.7,11\n0.7,11\n",
    (HEAD + 501 * "0.7,0.37\n").encode(),
    f"{HEAD}0.7,0.37\n0,0.37\n".encode(), f"{HEAD}0.7,0.37\n0.7,0\n".encode(), f"{HEAD}0.7,0.37\n0.7,inf\n".encode(),
    b"period_s,period_s\n0.7,0.7\n0.7,0.7\n", b"length_m,angle\n0.3,0.2\n0.3,0.2\n",
    b"period,length_m\n0.7,0.3\n0.7,0.3\n",
    b"period_s [furlong],length_m\n0.7,0.3\n0.7,0.3\n", b"time,angle 1,angle 2\n0,0,0\n1,0,0\n", b"\xff\xfe\x00\xd8",
]  # fmt: skip


def refused(folder, monkeypatch, *options):
    """Run the command in the folder, check that it refuses and leaves no files, and return its messages."""
    monkeypatch.chdir(folder)
    done = CliRunner().invoke(program(), ["identify", *options])
    assert done.exit_code in (2, 3), (done.output, done.exception)
    assert not list(folder.rglob("identif*"))
    text = " ".join(done.output.split())
    assert "Traceback" not in text
    assert "Error" in text or "error: " in text
    return text


@pytest.mark.parametrize("options", DAMAGED_OPTIONS, ids=" ".join)
def test_malformed_option_is_rejected(options, tmp_path, monkeypatch):
    (tmp_path / "steps.csv").write_text(GOOD)
    refused(tmp_path, monkeypatch, "--data", "steps.csv", *options)


@pytest.mark.parametrize("data", DAMAGED_FILES, ids=repr)
def test_error_names_the_damaged_file(data, tmp_path, monkeypatch):
    (tmp_path / "steps.csv").write_bytes(data)
    assert "steps.csv" in refused(tmp_path, monkeypatch, "--data", "steps.csv", *FIT)


@pytest.mark.parametrize("path", ["nowhere.csv", ".", "", "steps.csv/x"])
def test_missing_file_is_rejected(path, tmp_path, monkeypatch):
    (tmp_path / "steps.csv").write_text(GOOD)
    refused(tmp_path, monkeypatch, "--data", path, *FIT)


def damaged(text, rng):
    """Return a file with bytes changed, rows lost, repeated or cut, or cells replaced."""
    rows = text.splitlines()
    for _ in range(rng.integers(1, 4)):
        place = int(rng.integers(len(rows)))
        cells = rows[place].split(",")
        cells[int(rng.integers(len(cells)))] = str(
            rng.choice(["", "nan", "-1", "1e400", "x", "0,7", '"', "1 2", "7e9"])
        )
        rows[place] = [",".join(cells), rows[place][: len(rows[place]) // 2], f"{rows[place]},1", ""][rng.integers(4)]
        if rng.random() < 0.2:
            rows.insert(place, rows[int(rng.integers(len(rows)))])
    data = bytearray("\n".join(rows).encode())
    if data and rng.random() < 0.3:
        data[int(rng.integers(len(data)))] = int(rng.integers(256))
    return bytes(data)


@pytest.mark.parametrize("level", ["steps", "angles"])
def test_randomly_damaged_file_is_read_or_rejected(level, tmp_path):
    rng, path = np.random.default_rng(11), tmp_path / "walk.csv"
    times = np.arange(0.0, 3.0, 0.02)
    swing = 0.2 * np.sin(2.0 * np.pi * times / 1.4)
    angles = "".join(f"{t:.3f},{a:.6f},{-a:.6f}\n" for t, a in zip(times.tolist(), swing.tolist(), strict=True))
    text = GOOD if level == "steps" else f"time (s),angle 1 (rad),angle 2 (rad)\n{angles}"
    config = taken(*ask(path, f"identify.level={level}", "identify.fit={slope_deg: null}"))
    counts, problems = [], []
    for _ in range(100):
        path.write_bytes(damaged(text, rng))
        try:
            counts.append(next(MeasuredFile(config.identify, config).divisions()).count)
        except ConfigError as error:
            problems.append(error)
    assert all(count >= 2 for count in counts)
    assert len(problems) > 20
    assert all(str(path) in str(problem) and problem.advice for problem in problems)


def test_misfit_suggests_no_next_command(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    Path("steps.csv").write_text(GOOD)
    done = CliRunner().invoke(program(), ["identify", "--data", "steps.csv", *FIT])
    assert done.exit_code == 0, done.output
    assert "Do not use the estimates below." in " ".join(done.output.split())
    assert "identified.yaml" in done.output
    assert "next: " not in done.output


def test_misspelt_key_suggests_the_nearest(tmp_path):
    path = tmp_path / "steps.csv"
    path.write_text(GOOD)
    with pytest.raises(ConfigError, match=r"identify\.fit: walker\.hip_mas_kg .*did you mean walker\.hip_mass_kg"):
        identify.refuse(taken(*ask(path, "identify.fit={walker.hip_mas_kg: null}")))


def test_report_section_begins_with_the_estimates(identified):
    part = section(Results(load(Path("paper"), ()).config, {"identify": identified}))
    assert part is not None
    assert part.finding.startswith("The hip weighs ")
    captions = [block.caption for block in part.blocks if isinstance(block, Table)]
    assert captions == ["Estimates", "Fit to the measurements", "If a fixed parameter is off"]


def test_table_of_periods_alone_is_read(tmp_path):
    path = tmp_path / "stopwatch.csv"
    path.write_text("period_s\n0.70\n0.71\n0.70\n")
    measured = next(MeasuredFile(taken(*ask(path)).identify, taken()).divisions())
    assert measured.periods_s.tolist() == [0.70, 0.71, 0.70]
    assert measured.lengths_m is None


@pytest.mark.parametrize(("column", "unit"), [("length_mm", "mm"), ("touch_angle_deg", "deg")])
def test_column_in_another_unit_is_not_ignored(tmp_path, column, unit):
    path = tmp_path / "stopwatch.csv"
    path.write_text(f"period_s,{column}\n0.70,21\n0.71,22\n0.70,21\n")
    with pytest.raises(ConfigError, match=f"has a column '{column}'") as caught:
        MeasuredFile(taken(*ask(path)).identify, taken())
    assert f"={column} [{unit}]" in caught.value.advice


def test_column_that_begins_like_a_quantity_but_names_no_unit_is_left_alone(tmp_path):
    path = tmp_path / "stopwatch.csv"
    path.write_text("period_s,length_note\n0.70,1\n0.71,2\n0.70,3\n")
    assert next(MeasuredFile(taken(*ask(path)).identify, taken()).divisions()).lengths_m is None


def test_steps_in_the_docs_example_hardly_reveal_a_wrong_leg_length(gait):
    """docs/identify-mistakes.md states the difference of the log-likelihood, 0.5."""
    table = Path(__file__).parents[3] / "docs" / "downloads" / "stopwatch.csv"
    asked = ask(table, "identify.fit={slope_deg: null, walker.hip_mass_kg: null}")
    wrong, right = (
        identify.run(taken(*asked, f"walker.leg_length_m={leg}"), gait, Silent()).summary["models"][0]
        for leg in (0.97, 1.0)
    )
    assert right["log_likelihood"] - wrong["log_likelihood"] == pytest.approx(0.5, abs=0.05)
    assert wrong["fit"] == "fits"


def test_noise_of_a_quantity_never_exceeds_its_size(tmp_path, gait):
    """If all lengths are equal to the last digit, they show no noise, so that any noise of the periods would fit."""
    path = tmp_path / "table.csv"
    path.write_text("period_s,length_m\n" + "".join(f"{(0.59, 0.77)[k % 2]},0.0171\n" for k in range(10)))
    fit = "identify.fit={slope_deg: [0.1, 6], walker.leg_length_m: [0.6, 2]}"
    summary = identify.run(taken(*ask(path, fit)), gait, Silent()).summary
    assert summary["models"][0]["fit"] == "misfit"
    assert "the step period differs from the model by" in summary["models"][0]["reason"]
    assert summary["noise"]["measurement"]["step_period_s"] < 0.7


@pytest.fixture(scope="module")
def from_angles(transient, gait, tmp_path_factory):
    """Identify the walker from angles of the transient."""
    samples, path = transient.groups["trajectory"], tmp_path_factory.mktemp("film") / "angles.csv"
    time, angle = samples["time"], samples["angle"]
    rising = np.append(True, np.diff(time) > 0.0) & (time < 4.0)
    lines = (f"{t!r},{a!r},{b!r}" for t, (a, b) in zip(time[rising].tolist(), angle[rising].tolist(), strict=True))
    path.write_text("time (s),angle 1 (rad),angle 2 (rad)\n" + "\n".join(lines))
    changes = ask(path, "identify.level=angles", "identify.fit={slope_deg: null}")
    return identify.run(taken(*changes), gait, Silent())


def written_angles(path, transient, offset):
    """Write angles of the first 4 s of the transient at 100 Hz, with an offset and noise."""
    samples, time = transient.groups["trajectory"], np.arange(0.0, 4.0, 0.01)
    noise = 1e-3 * np.random.default_rng(8).standard_normal((time.size, 2))
    angle = np.column_stack([np.interp(time, samples["time"], leg) for leg in samples["angle"].T]) + noise + offset
    lines = (f"{t!r},{a!r},{b!r}" for t, (a, b) in zip(time.tolist(), angle.tolist(), strict=True))
    path.write_text("time (s),angle 1 (rad),angle 2 (rad)\n" + "\n".join(lines))
    return path


def test_offset_of_the_sensors_is_estimated_with_the_walker(transient, gait, tmp_path):
    path = written_angles(tmp_path / "off.csv", transient, 0.02)
    changes = ask(path, "identify.level=angles", "identify.fit={slope_deg: null}", "slope_deg=1.2")
    summary = identify.run(taken(*changes, "identify.nuisance=[angle_offset_rad]"), gait, Silent()).summary
    (slope,), offset = summary["estimates"], summary["nuisance"]["angle_offset_rad"]
    assert summary["models"][0]["fit"] == "fits"
    assert abs(slope["value"] - 0.9969465635) < 4.0 * slope["standard_error"] < 0.05
    assert abs(offset["value"] - 0.02) < 4.0 * offset["standard_error"] < 2e-3
    text = " ".join(" ".join(answer("identify", summary)).split())
    assert "The angle offset is 0.0" in text


def test_offset_that_is_not_estimated_is_mentioned(transient, gait, tmp_path):
    path = written_angles(tmp_path / "off.csv", transient, 0.02)
    changes = ask(path, "identify.level=angles", "identify.fit={walker.hip_mass_kg: null}")
    summary = identify.run(taken(*changes), gait, Silent()).summary
    assert summary["models"][0]["fit"] == "misfit"
    assert "--nuisance angle_offset_rad" in " ".join(" ".join(answer("identify", summary)).split())


def test_sensitivity_of_the_identified_gait_has_a_standard_error(table, gait):
    fit = "identify.fit={slope_deg: null}"
    summary = identify.run(taken(*ask(table, fit, "identify.robustness=true")), gait, Silent()).summary
    norm = summary["gait"]["drop_sensitivity_s_m"]
    # norm of the gait of the config, from `walkerlab robustness`
    assert abs(norm["value"] - 25.271) < 4.0 * norm["standard_error"] < 5.0
    assert "a sensitivity norm (period for a drop of the floor) of 25" in " ".join(answer("identify", summary))


def test_prior_that_the_walk_contradicts_is_named(table, gait):
    fit, prior = "identify.fit={slope_deg: null}", "identify.prior={walker.leg_length_m: [1.1, 0.01]}"
    summary = identify.run(taken(*ask(table, fit, prior)), gait, Silent()).summary
    assert summary["prior"][0]["distance"] > 3.0
    text = " ".join(" ".join(answer("identify", summary)).split())
    assert "The walk contradicts the prior of the leg length, 1.100 ± 0.010 m, by " in text


def test_measured_and_identified_motions_agree_with_the_simulated_walk(from_angles, transient):
    walk = transient.groups["trajectory"]
    for name in ("identified_motion", "measured_motion"):
        motion = from_angles.groups[name]
        assert set(motion["step"].tolist()) == set(range(from_angles.summary["steps"]))
        inside = slice(5, -5)
        for along in ("hip_along_m", "hip_height_m"):
            expected = np.interp(motion["time"], walk["time"], walk[along])
            assert np.allclose(motion[along][inside], expected[inside], atol=5e-3), (name, along)
        assert motion["foot_height_m"].min() > -2e-3


def test_page_overlays_the_measured_and_the_identified_walk(from_angles):
    (player,) = (
        block
        for block in section(Results(load(Path("paper"), ()).config, {"identify": from_angles})).blocks
        if isinstance(block, Player)
    )
    assert [(walker.name, walker.style) for walker in player.walkers] == [
        ("Identified walk", "rigid"),
        ("Measured walk", "contact"),
    ]
    assert not player.shows_forces


def test_identification_from_steps_alone_has_no_player(identified):
    part = section(Results(load(Path("paper"), ()).config, {"identify": identified}))
    assert not any(isinstance(block, Player) for block in part.blocks)


def test_worst_combinations_reproduce_the_covariance(identified):
    moves = identified.groups["worst"]["moves"]
    # With two parameters, both combinations together give the whole covariance.
    assert np.allclose(moves.T @ moves, identified.groups["covariance"]["covariance"], rtol=1e-9)


def test_noise_is_at_least_the_rounding_of_the_file(tmp_path, gait):
    path = tmp_path / "stopwatch.csv"
    path.write_text("T [ms]\n" + "\n".join(["730", "740", "730", "740", "730", "740"]))
    changes = ask(path, "identify.columns={period_s: T}", "identify.units={time: ms}", "identify.fit={slope_deg: null}")
    measured = next(MeasuredFile(taken(*changes).identify, taken()).divisions())
    assert measured.resolution == {"step_period_s": pytest.approx(0.001)}
    summary = identify.run(taken(*changes), gait, Silent()).summary
    assert summary["noise"]["measurement"]["step_period_s"] >= 0.001 / np.sqrt(12.0) * (1.0 - 1e-9)


def test_angles_in_degrees_are_rounded_to_their_last_digit(tmp_path, transient):
    path = written_angles(tmp_path / "angles.csv", transient, 0.0)
    time, *angles = np.loadtxt(path, delimiter=",", skiprows=1).T
    rows = "\n".join(f"{t:.3f},{a:.1f},{b:.1f}" for t, a, b in zip(time, *np.degrees(angles), strict=True))
    path.write_text(f"time (s),angle 1 (deg),angle 2 (deg)\n{rows}")
    measured = next(MeasuredFile(taken(*ask(path, "identify.level=angles")).identify, taken()).divisions())
    assert measured.resolution == {"angle_rad": pytest.approx(np.radians(0.1), rel=1e-6)}


class Counting(Silent):
    """Progress display that counts the parts of each phase."""

    def __init__(self):
        self.phases = []

    def start(self, label, total=None):
        self.phases.append([label, total, 0])

    def advance(self, n=1):
        self.phases[-1][2] += n


def test_progress_of_a_fit_names_model_and_start(table, gait):
    progress = Counting()
    identify.run(taken(*ask(table, "identify.fit={slope_deg: null}", "identify.starts=2")), gait, progress)
    assert [label for label, _, _ in progress.phases] == ["rigid model, start 1 of 2", "rigid model, start 2 of 2"]
    assert all(0 < done <= total for _, total, done in progress.phases)


def test_exhausted_fit_budget_gives_no_answer_but_keeps_the_best_fit(table, gait):
    changes = ask(table, "identify.fit={slope_deg: null}", "slope_deg=1.3", "identify.max_walks=1")
    with pytest.raises(NoAnswer) as caught:
        identify.run(taken(*changes), gait, Silent())
    assert "the budget of 1 predicted walks is exhausted (identify.max_walks)" in str(caught.value)
    assert caught.value.partial.summary["models"][0]["fit"] == "not-converged"


def test_estimates_with_doubts_are_used_and_the_doubts_listed(table, gait):
    changes = ask(table, "identify.fit={slope_deg: null}", "identify.prior={walker.leg_length_m: [1.1, 0.01]}")
    summary = identify.run(taken(*changes), gait, Silent()).summary
    assert summary["models"][0]["fit"] == "fits-but"
    text = " ".join(" ".join(answer("identify", {**summary, "config": "identified.yaml"})).split())
    assert "The errors may be too small: the walk contradicts the prior of 1.1 for walker.leg_length_m by" in text
    assert "next: `walkerlab report -c identified.yaml`" in text
