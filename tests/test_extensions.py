"""Tests of extensions in other packages: the example of the docs and faulty ones, installed in the way of pip."""

import json
import os
import re
import shutil
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest

import walkerlab
from walkerlab.config.loader import load
from walkerlab.extensions import Extension, refuse_other_versions
from walkerlab.pipeline.plan.graph import PIPELINE
from walkerlab.pipeline.sweeps.chunk import compute_point

ROOT = Path(__file__).parent.parent
EXAMPLE = ROOT / "docs" / "examples" / "extension"
PACKAGE = "tanh_friction"


def announce(folder, distribution, entries):
    """Write the metadata of a distribution, version 1.0, that is installed in a folder."""
    info = folder / f"{distribution.replace('-', '_')}-1.0.dist-info"
    info.mkdir(parents=True)
    (info / "METADATA").write_text(f"Metadata-Version: 2.1\nName: {distribution}\nVersion: 1.0\n")
    lines = [f"{name} = {code}\n" for name, code in entries.items()]
    (info / "entry_points.txt").write_text("".join(["[walkerlab.extensions]\n", *lines]))


def install_example(folder):
    shutil.copytree(EXAMPLE / PACKAGE, folder / PACKAGE, ignore=shutil.ignore_patterns("__pycache__"))
    project = tomllib.loads((EXAMPLE / "pyproject.toml").read_text())["project"]
    announce(folder, project["name"], project["entry-points"]["walkerlab.extensions"])


def add(folder, distribution, text, **entries):
    """Install a package that consists of one module."""
    name = distribution.replace("-", "_")
    folder.mkdir(exist_ok=True)
    (folder / f"{name}.py").write_text(text)
    announce(folder, distribution, entries or {distribution: f"{name}:EXTENSION"})


class Site:
    """A folder of installed packages, and a way to run the program so that it finds them."""

    def __init__(self, folder):
        self.folder, self.packages = folder, folder / "site"
        self.environment = {**os.environ, "PYTHONPATH": str(self.packages), "XDG_CACHE_HOME": str(folder / "cache")}

    def python(self, code, *arguments, environment=()):
        return subprocess.run(
            [sys.executable, "-B", "-c", code, *map(str, arguments)],
            cwd=self.folder, env={**self.environment, **dict(environment)}, capture_output=True, text=True,
        )  # fmt: skip

    def __call__(self, *words):
        return self.python("from walkerlab.views.cli.main import main; main()", *words)


@pytest.fixture
def site(tmp_path):
    return Site(tmp_path)


@pytest.fixture(scope="module")
def example(tmp_path_factory):
    site = Site(tmp_path_factory.mktemp("example"))
    install_example(site.packages)
    return site


WALK = (
    "--set", "contact.friction=tanh", "--set", "contact.terrain=after-mid-swing", "--set", "outputs=[states, forces]",
    "--set", "solver.contact.method=scipy-lsoda", "--strides", "1", "--name", "tanh",
)  # fmt: skip


@pytest.fixture(scope="module")
def walked(example):
    """Return a walk of the example on its friction law."""
    done = example("contact-sim", *WALK, "--jobs", "1", "--json")
    assert done.returncode == 0, done.stderr
    return example, json.loads(done.stdout)


def test_example_law_and_figure_take_at_most_forty_lines():
    texts = [path.read_text() for path in (EXAMPLE / PACKAGE).glob("*.py")]
    assert sum(bool(line.strip()) for text in texts for line in text.splitlines()) <= 40


def test_docs_show_the_whole_example():
    page = (ROOT / "docs" / "adding.md").read_text()
    for path in (EXAMPLE / PACKAGE).glob("*.py"):
        assert f"```python\n{path.read_text()}```" in page
    lines = (EXAMPLE / "pyproject.toml").read_text().splitlines()
    assert f"```toml\n{chr(10).join(lines[-2:])}\n```" in page


def test_example_can_be_installed_with_pip(tmp_path):
    pytest.importorskip("hatchling")
    pytest.importorskip("pip")
    source = shutil.copytree(EXAMPLE, tmp_path / "source")
    options = ["--no-deps", "--no-build-isolation", "--no-index", "--quiet", "--disable-pip-version-check"]
    command = [sys.executable, "-m", "pip", "install", *options, "--target", tmp_path / "site", source]
    done = subprocess.run(command, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    assert "tanh-friction (tanh-friction 1.0): friction: tanh\n" in Site(tmp_path)("extensions").stdout


def test_walk_uses_the_law_of_an_extension_and_records_its_origin(walked):
    site, summary = walked
    assert summary["friction"] == "friction of 0.7 tanh(v / 0.1 m/s)"
    assert "tanh-friction 1.0" in site("show", "tanh", "contact-sim").stdout


def test_figure_of_an_extension_is_drawn(walked):
    site, _ = walked
    done = site("export", "tanh", "friction-over-slip", "--to", "svg", "-o", "drawn.svg")
    assert done.returncode == 0, done.stderr
    assert "<svg" in (site.folder / "drawn.svg").read_text()


def stale(site):
    rows = json.loads(site("status", *WALK, "--json").stdout)["stages"]
    return {row["stage"] for row in rows if row["state"] == "stale"}


def test_editing_a_law_invalidates_results_but_editing_a_figure_does_not(walked):
    site, _ = walked
    law, figure = (site.packages / PACKAGE / f"{name}.py" for name in ("law", "figure"))
    before = {path: path.read_text() for path in (law, figure)}
    try:
        assert stale(site) == set()
        figure.write_text(before[figure].replace('"."', '"x"'))
        assert stale(site) == set()
        law.write_text(before[law].replace("3 * v, 3 * v", "2 * v, 2 * v"))
        assert stale(site) == {"contact-sim"}
    finally:
        for path, text in before.items():
            path.write_text(text)
    assert stale(site) == set()


HUNT_CROSSLEY = """
from typing import NamedTuple
from walkerlab.physics.ground.normal_force import NormalForce, elastic_energy, normal_force, release_function
from walkerlab.physics.ground.resting import resting_foot

class HuntCrossley(NamedTuple):
    k: float
    exponent: float
    a: float

    @classmethod
    def from_contact(cls, contact):
        return cls(contact.stiffness, contact.exponent, 1e-3 * contact.damping)

    def resting_foot(self, weight, mass):
        depth = (weight / self.k) ** (1.0 / self.exponent)
        return resting_foot(weight, mass, self.k, self.exponent, self.a * self.k * depth**self.exponent)

    def stiffen(self, stiffness, damping, penetration):
        return self._replace(k=self.k * stiffness, a=self.a * damping / stiffness)

@normal_force.case(HuntCrossley)
def force(law, d, rate):
    spring, factor = law.k * d**law.exponent, 1.0 + law.a * rate
    if factor <= 0.0:
        return NormalForce(0.0, spring, 0.0, 0.0)
    return NormalForce(spring * factor, spring, law.exponent * spring / d * factor, law.a * spring)

@release_function.case(HuntCrossley)
def release(law, d, rate):
    return 1.0 + law.a * rate

@elastic_energy.case(HuntCrossley)
def energy(law, d):
    return law.k * max(d, 0.0) ** (law.exponent + 1.0) / (law.exponent + 1.0)
"""


def test_energy_balances_with_the_normal_force_of_an_extension(site):
    declaration = "Extension(1, normal_force={'hunt-crossley': 'hunt_crossley_law:HuntCrossley'})"
    add(site.packages, "hunt-crossley", f"from walkerlab.extensions import Extension\nEXTENSION = {declaration}\n")
    (site.packages / "hunt_crossley_law.py").write_text(HUNT_CROSSLEY)
    walk = ("contact-sim", "-c", "slope-3deg", "--strides", "1", "--jobs", "1", "--json", "--set")
    method = ("--set", "solver.contact.method=scipy-lsoda")
    done = site(*walk, "contact.normal_force=hunt-crossley", *method)
    assert done.returncode == 0, done.stderr
    own = json.loads(done.stdout)
    assert own["outcome"] == "walked"
    assert abs(own["energy_balance_residual_J"]) < 1e-4 * own["dissipated_J"]["damping"]
    adams = json.loads(site(*walk, "contact.normal_force=impact", *method).stdout)
    assert own["step_period_s"] == pytest.approx(adams["step_period_s"], rel=0.02)
    assert own["step_period_s"] != adams["step_period_s"]
    done = site("export", "paper", "model", "--to", "adm", "--set", "contact.normal_force=hunt-crossley")
    assert done.returncode == 3
    assert "The normal-force law HuntCrossley cannot be exported." in done.stderr


CUBIC = re.compile(r"```python.(from walkerlab.physics.mechanics.hinges.*?)```", re.DOTALL)
# copy of the built-in law, the cubic spring of the docs, and laws with a fault
HINGES = f"""
import typing
{CUBIC.search((ROOT / "docs" / "adding.md").read_text())[1]}

class Linear(SpringDamper):
    pass

@hinge_torque.case(Linear)
def linear(law, angle, rate):
    elastic = law.stiffness * angle
    return HingeTorque(elastic + law.damping * rate - law.torque, elastic, law.stiffness, law.damping)

@hinge_energy.case(Linear)
def linear_energy(law, angle):
    return 0.5 * law.stiffness * angle * angle

class Apart(typing.NamedTuple):
    torque: float
    stiffness: float
    damping: float
    units = None

@hinge_torque.case(Apart)
@hinge_energy.case(Apart)
def apart(law, angle, rate=0.0):
    return law.torque

class Halfway(SpringDamper):
    pass

@hinge_torque.case(Halfway)
def halfway(law, angle, rate):
    return cubic_torque(law, angle, rate)
"""


@pytest.fixture(scope="module")
def hinges(tmp_path_factory):
    """Install a package of hinge laws: a copy of the built-in law, the cubic spring of the docs, and three
    faulty laws.
    """
    site = Site(tmp_path_factory.mktemp("hinges"))
    laws = {"copy": "hinge_laws:Linear", "cubic": "hinge_laws:Cubic", "halfway": "hinge_laws:Halfway"}
    laws |= {"apart": "hinge_laws:Apart", "torn": "torn_law:Torn"}
    declaration = f"from walkerlab.extensions import Extension\nEXTENSION = Extension(1, hinge_law={laws})\n"
    add(site.packages, "hinges", declaration)
    (site.packages / "hinge_laws.py").write_text(HINGES)
    (site.packages / "torn_law.py").write_text("1 / 0\n")
    return site


def sprung_walk(site, command, law):
    parameters = "spring_N_m_per_rad: 30, damping_N_m_s_per_rad: 0.1, torque_N_m: 0.5"
    methods = [f"solver.{model}.method=scipy-lsoda" for model in ("rigid", "contact")]
    settings = [f"walker.hip={{{parameters}, hinge_law: {law}}}", *methods]
    words = [word for setting in settings for word in ("--set", setting)]
    done = site(command, "-c", "slope-3deg", "--strides", "1", *words, "--jobs", "1", "--json", "--name", law)
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout)


@pytest.mark.parametrize("command", ["simulate", "contact-sim"])
def test_copy_of_the_built_in_hinge_law_gives_the_same_walk_to_the_last_digit(hinges, command):
    built_in, copied = (sprung_walk(hinges, command, law) for law in ("linear", "copy"))
    same = {key for key, value in built_in.items() if copied[key] == value}
    assert {"step_period_s", "step_length_m", "outcome", "energy_balance_residual_J"} <= same
    assert copied["step_period_s"] > 0.0


def test_energy_balances_with_the_cubic_hip_spring_of_an_extension(hinges):
    cubic = sprung_walk(hinges, "contact-sim", "cubic")
    assert abs(cubic["energy_balance_residual_J"]) < 1e-4 * cubic["dissipated_J"]["damping"]
    assert cubic["step_period_s"] != sprung_walk(hinges, "contact-sim", "linear")["step_period_s"]


REFUSALS = {
    "halfway": "the hinge law Halfway ('halfway') is incomplete: it lacks a case @hinge_energy.case(Halfway)",
    "apart": "the hinge law Apart ('apart') is incomplete: it lacks the base class SpringDamper",
    "torn": "hinge_law: the code of 'torn' cannot be imported: ZeroDivisionError: division by zero",
}


@pytest.mark.parametrize("law", REFUSALS)
def test_faulty_hinge_law_is_refused_before_the_walk(hinges, law):
    done = hinges("simulate", "--set", f"walker.hip.hinge_law={law}", "--name", law)
    assert done.returncode == 3
    assert REFUSALS[law] in " ".join(done.stderr.split())


def test_other_programs_refuse_the_hinge_law_of_an_extension(hinges):
    done = hinges("export", "paper", "model", "--to", "mjcf", "--set", "walker.hip.hinge_law=cubic")
    assert done.returncode == 3
    assert "The hinge law cubic cannot be exported." in done.stderr


RODS = """
from typing import ClassVar, Literal
from walkerlab.config.drives import Hip
from walkerlab.config.fields import key
from walkerlab.config.walkers import (
    AssembledWalker, KneeJoint, PartBody, PartFoot, PartHinge, PartParticle, Torso, length, mass,
)

class Rods(AssembledWalker):
    \'\'\'Two uniform rods and a mass at the hip.\'\'\'

    type: Literal["rods"] = key("rods", "", "kind of walker")
    leg_length_m: float = length(1.0, "length of a rod")
    leg_mass_kg: float = mass(5.0, "mass of a rod")
    hip_mass_kg: float = mass(10.0, "mass at the hip")
    knee: KneeJoint = KneeJoint()
    torso: Torso | None = None
    hip: Hip = Hip()
    legs: ClassVar = (("rod 1",), ("rod 2",))
    couplings: ClassVar = ()

    @property
    def bodies(self):
        middle, inertia = (0.0, 0.5 * self.leg_length_m), self.leg_mass_kg * self.leg_length_m**2 / 12.0
        rod = dict(mass_kg=self.leg_mass_kg, centre_m=middle, inertia_kg_m2=inertia)
        return tuple(PartBody(name=name, **rod) for (name,) in self.legs)

    @property
    def hinges(self):
        top = (0.0, self.leg_length_m)
        return (PartHinge(name="hip", parent="rod 1", parent_point_m=top, child="rod 2", child_point_m=top),)

    @property
    def particles(self):
        return (PartParticle(name="hip", mass_kg=self.hip_mass_kg, body="rod 1", at_m=(0.0, self.leg_length_m)),)

    @property
    def feet(self):
        return tuple(PartFoot(body=name, centre_m=(0.0, 0.0), radius_m=0.0) for (name,) in self.legs)
"""


def install_rods(site, module=RODS):
    declaration = "Extension(1, walkers={'rods': 'rods_walker:Rods'})"
    add(site.packages, "rods", f"from walkerlab.extensions import Extension\nEXTENSION = {declaration}\n")
    (site.packages / "rods_walker.py").write_text(module)


def test_walker_of_an_extension_has_the_gait_of_equal_straight_legs(site):
    install_rods(site)
    (site.folder / "rods.yaml").write_text("name: rods\nslope_deg: 3\nwalker: {type: rods, leg_mass_kg: 4}\n")
    equal = {"leg_length_m": 1.0, "leg_mass_kg": 4.0, "leg_mass_below_hip_m": 0.5, "leg_inertia_kg_m2": 4.0 / 12.0}
    walker = {"type": "straight-legs", **equal, "hip_mass_kg": 10.0, "foot_radius_m": 0.0}
    (site.folder / "equal.yaml").write_text(f"name: equal\nslope_deg: 3\nwalker: {json.dumps(walker)}\n")
    done = site("fixedpoint", "-c", "rods.yaml", "--json")
    assert done.returncode == 0, done.stderr
    own, same = json.loads(done.stdout), json.loads(site("fixedpoint", "-c", "equal.yaml", "--json").stdout)
    assert own["step_period_s"] == pytest.approx(same["step_period_s"], rel=1e-10)
    assert own["state"] == pytest.approx(same["state"], abs=1e-10)
    done = site("sweep", "-c", "rods.yaml", "--over", "walker.leg_mass_kg=4:6:2", "--stage", "fixedpoint", "--json")
    assert done.returncode == 0, done.stderr
    assert "rods" in site("extensions").stdout
    assert "length of a rod" in " ".join(site("schema", "walker").stdout.split())


def test_unknown_key_of_an_extension_walker_is_refused_with_the_nearest_key(site):
    install_rods(site)
    (site.folder / "rods.yaml").write_text("name: rods\nwalker: {type: rods, leg_mas_kg: 4}\n")
    done = site("fixedpoint", "-c", "rods.yaml")
    assert done.returncode == 3
    assert "rods.yaml:2" in done.stderr
    assert "leg_mass_kg" in done.stderr


def test_walker_type_that_cannot_be_imported_is_left_out_and_the_rest_works(site):
    install_rods(site, "raise ImportError('no rods today')")
    done = site("schema", "walker.type")
    assert done.returncode == 0, done.stderr
    left_out = "the walker type rods of an extension (rods_walker:Rods) is left out: ImportError: no rods today"
    assert left_out in done.stderr
    (site.folder / "rods.yaml").write_text("name: rods\nwalker: {type: rods}\n")
    done = site("fixedpoint", "-c", "rods.yaml")
    assert done.returncode == 3
    assert "rods is not a known type" in done.stderr.replace("'", "")


KERNEL = """
import math
from types import SimpleNamespace
from walkerlab.extensions import code_by_word, load
from walkerlab.physics import kernel_cache
from walkerlab.physics.ground.friction import friction_coefficient
from walkerlab.physics.kernels import kernel
names = []
kernel_cache.watchers.append(names.append)
@kernel
def friction_at(law, slip):
    return friction_coefficient(law, slip)[0]
def answer():
    kind = load(code_by_word("friction")["tanh"])
    law = kind.from_contact(SimpleNamespace(dynamic_friction=0.5, stiction_velocity=0.1))
    assert math.isclose(friction_at(law, 0.1), friction_coefficient(law, 0.1)[0])
    return names
"""


def test_editing_a_law_recompiles_its_kernels(site):
    install_example(site.packages)
    (site.packages / "kernel_of_friction.py").write_text(KERNEL)

    def compiled():
        cache = {"WALKERLAB_CACHE": str(site.folder / "kernels")}
        done = site.python("import kernel_of_friction; print(*kernel_of_friction.answer())", environment=cache)
        assert done.returncode == 0, done.stderr
        return done.stdout.split()

    assert compiled() == ["friction_at"]
    assert compiled() == []
    law = site.packages / PACKAGE / "law.py"
    law.write_text(law.read_text().replace("t = math.tanh(", "t = 2.0 * math.tanh("))
    assert compiled() == ["friction_at"]


def test_schema_names_the_extension_of_an_option(example):
    assert "tanh: extension tanh-friction (tanh-friction 1.0)" in " ".join(
        example("schema", "contact.friction").stdout.split()
    )
    schema = json.loads(example("schema", "contact.friction", "--json").stdout)
    assert schema["enum"] == ["coulomb", "none", "tanh"]
    assert "tanh-friction 1.0" in schema["source"]


def test_built_in_extensions_are_listed_with_what_they_add(example):
    rows = {row["name"]: row for row in json.loads(example("extensions", "--json").stdout)["extensions"]}
    assert list(rows) == [*walkerlab.EXTENSIONS, "tanh-friction"]
    assert rows["study"]["source"] == f"walkerlab {walkerlab.__version__}"
    assert rows["study"]["adds"]["equations"] == ["as-printed"]
    assert rows["tanh-friction"]["adds"]["friction"] == ["tanh"]


def test_config_with_a_missing_extension_lists_the_installed_ones(site):
    add(site.packages, "other", "from walkerlab.extensions import Extension\nEXTENSION = Extension(1)\n")
    done = site("contact-sim", "--set", "contact.friction=tanh")
    assert done.returncode == 3
    assert (
        "one of coulomb, none, or a word of an extension: install the one that adds it (installed: other)"
        in done.stderr
    )


FAULTS = {
    "ImportError: no such thing": "raise ImportError('no such thing')",
    "SystemExit: 1": "import sys\nsys.exit(1)",
    "it is of type int, not Extension": "EXTENSION = 1",
    "it was written for interface 99": "from walkerlab.extensions import Extension\nEXTENSION = Extension(99)",
    "unexpected keyword argument": "from walkerlab.extensions import Extension\nEXTENSION = Extension(1, robots='')",
    "No module named 'nowhere'": (
        "from walkerlab.extensions import Extension\nEXTENSION = Extension(1, friction={'icy': 'nowhere.law:Law'})"
    ),
    "it must name that code in quotes": "from walkerlab.config.schema import Config\nEXTENSION = 1",
    "'json' does not have the form module:name": (
        "from walkerlab.extensions import Extension\nEXTENSION = Extension(1, figures='json')"
    ),
    "its sections must be at task, walks, evidence, benchmarks": (
        "from walkerlab.extensions import Extension\nEXTENSION = Extension(1, sections={'top': ()})"
    ),
    "it has answers or tables for stages that are not its own": (
        "from walkerlab.extensions import Extension\nEXTENSION = Extension(1, answers={'simulate': 'json:dumps'})"
    ),
}


@pytest.mark.parametrize("why", FAULTS)
def test_broken_extension_is_reported_and_the_rest_works(site, why):
    install_example(site.packages)
    add(site.packages, "broken", FAULTS[why])
    done = site("schema", "contact.friction")
    assert done.returncode == 0
    assert "warning: extension broken (broken 1.0) is left out: " in done.stderr
    assert why in done.stderr
    assert "tanh" in done.stdout
    assert "broken (broken 1.0): left out, " in site("extensions").stdout


def extension(**adds):
    listed = ", ".join(f"{name}={value}" for name, value in adds.items())
    return f"import json\nfrom walkerlab.extensions import Extension\nEXTENSION = Extension(1, {listed})\n"


STAGE = "from walkerlab.pipeline.plan.stage import Stage\nfrom walkerlab.extensions import Extension\n"
CLASHES = {
    "walkerlab and second 1.0 both add the friction coulomb": extension(friction="{'coulomb': 'json:dumps'}"),
    "second 1.0 and tanh-friction 1.0 both add the friction tanh": extension(friction="{'tanh': 'json:dumps'}"),
    "walkerlab .* and second 1.0 both add the stage simulate": (
        f"{STAGE}EXTENSION = Extension(1, (Stage('simulate', 'json', '', object),))"
    ),
    "walkerlab and second 1.0 both add the stage status": (
        f"{STAGE}EXTENSION = Extension(1, (Stage('status', 'json', '', object),))"
    ),
}


@pytest.mark.parametrize("message", CLASHES)
def test_duplicate_names_are_an_error_in_every_command(site, message):
    install_example(site.packages)
    add(site.packages, "second", CLASHES[message])
    done = site("schema", "gravity_m_s2")
    assert done.returncode == 3
    assert re.search(message, done.stderr)
    assert "Uninstall one of the two" in done.stderr
    assert "second" in site("extensions").stdout


def test_two_extensions_with_the_same_name_are_reported(site):
    add(site.packages, "first", extension(), same="first:EXTENSION")
    add(site.packages, "second", extension(), same="second:EXTENSION")
    assert "first 1.0 and second 1.0 both add the extension same." in site("schema", "seed").stderr


SCANNED = """
import sys
from walkerlab.extensions import registry
print(*(found.name for found in registry() if found.source), "importlib.metadata" in sys.modules)
"""


def test_unchanged_folders_are_not_scanned_again(site):
    long_ago = 1_600_000_000
    install_example(site.packages)
    os.utime(site.packages, (long_ago, long_ago))
    os.utime(site.folder, (long_ago, long_ago))
    assert site.python(SCANNED).stdout.split() == ["tanh-friction", "True"]
    os.utime(site.folder, (long_ago, long_ago))
    assert site.python(SCANNED).stdout.split() == ["tanh-friction", "False"]
    add(site.packages, "new", extension())
    assert set(site.python(SCANNED).stdout.split()) == {"tanh-friction", "new", "True"}
    shutil.rmtree(site.packages / "tanh_friction-1.0.dist-info")
    assert site.python(SCANNED).stdout.split() == ["new", "True"]


def test_each_process_scans_for_extensions_if_there_is_no_cache_folder(site):
    install_example(site.packages)
    for _ in range(2):
        done = site.python(SCANNED, environment={"XDG_CACHE_HOME": "nowhere"})
        assert done.stdout.split() == ["tanh-friction", "True"]
    assert [path.name for path in site.folder.iterdir()] == ["site"]


def test_scans_writable_by_others_are_not_trusted(site):
    long_ago = 1_600_000_000
    install_example(site.packages)
    os.utime(site.packages, (long_ago, long_ago))
    site.python(SCANNED)
    (file,) = (site.folder / "cache").iterdir()
    assert file.stat().st_mode & 0o077 == 0
    file.write_text(file.read_text().replace("tanh_friction:EXTENSION", "evil:EXTENSION"))
    file.chmod(0o666)
    assert site.python(SCANNED).stdout.split() == ["tanh-friction", "True"]


def test_worker_with_different_extensions_reports_them(example):
    refuse_other_versions("")
    config = load().config
    asked = "tanh-friction: tanh-friction 1.0 (code 0123abcd)"
    (row,) = compute_point(config, "key", PIPELINE, "fixedpoint", False, "", asked).rows
    assert row.status == "failed"
    assert row.reason == f"this worker has the extensions [], and its caller [{asked}]."
    code = "from walkerlab.extensions import *; import walkerlab.extensions as e; print(e.versions())"
    assert "tanh-friction: tanh-friction 1.0 (code " in example.python(code).stdout


COPY = """
import sys, walkerlab
for name in ("study", "benchmarks", "verification"):
    del walkerlab.EXTENSIONS[name]
from walkerlab.views.cli.main import main
main()
"""


def test_study_runs_from_a_copy_outside_the_package(site):
    """The evidence uses only what other packages can use, so a copy outside the package gives the same verdict on the
    same walk.
    """
    shutil.copytree(
        Path(walkerlab.__file__).parent / "evidence",
        site.packages / "copied",
        ignore=shutil.ignore_patterns("__pycache__"),
    )
    for path in (site.packages / "copied").rglob("*.py"):
        path.write_text(path.read_text().replace("walkerlab.evidence", "copied"))
    names = {"study": "paper", "benchmarks": "benchmarks", "verification": "verification"}
    announce(site.packages, "copied", {name: f"copied.{folder}.extension:EXTENSION" for name, folder in names.items()})
    options = ("--jobs", "1", "--set", "strides=1", "--json", "--runs", "runs")
    outside = site.python(COPY, "compare", *options)
    assert outside.returncode == 0, outside.stderr
    assert "copied 1.0" in site.python(COPY, "extensions").stdout
    shutil.rmtree(site.folder / "runs")
    shutil.rmtree(site.packages)
    inside = site("compare", *options)
    judged, expected = (json.loads(done.stdout) for done in (outside, inside))
    assert judged["verdicts"] == expected["verdicts"]
    assert judged["paper_numbers"] == expected["paper_numbers"]


def test_extension_lists_all_the_code_it_registers():
    everything = Extension(1, figures="a:A", sections={"task": ("b:B",)}, friction={"icy": "c:C"})
    assert [*everything.code()] == ["a:A", "b:B", "c:C"]
