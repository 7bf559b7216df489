"""Compile kernels before they are used: while the package is built, and by `walkerlab compile`."""

import json
import os
import time
from collections.abc import Callable, Iterable
from functools import partial
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np

from walkerlab.config.files import DEFAULT, builtin_names
from walkerlab.config.loader import load
from walkerlab.config.schema import Config
from walkerlab.physics import kernel_cache
from walkerlab.pipeline.run.workers import map_in_order

HALF_ANGLE = 0.2  # rad, from the slope's normal to each leg at the start of a walk
COMPILING_BUDGET = 200  # right-hand sides, enough for the first step of each method
# One method for each form of the kernels: our two, and one from a library that calls the kernels from Python.
COMPILED_METHODS = ("radau5", "dop853", "scipy-radau")


def compile_rigid(method: str, config: Config) -> None:
    """Compile the kernels of the rigid model by simulating a step from rest."""
    from walkerlab.physics.hybrid.recorded_walk import take_walk
    from walkerlab.physics.hybrid.rigid_measures import energies, reactions
    from walkerlab.physics.orbits.rigid_map import RigidStepper, state_on_section, strike_section
    from walkerlab.physics.solvers.registry import Tolerances
    from walkerlab.scene.rigid import rigid_walker

    walker = rigid_walker(config)
    tolerances = Tolerances(method, 1e-6, 1e-6, COMPILING_BUDGET)
    z = np.eye(1, int(walker.coordinates)) * HALF_ANGLE
    samples = take_walk(walker, tolerances, state_on_section(walker, z[0]), 1, sampled=True).samples
    assert samples is not None
    energies(walker, samples.state)
    reactions(walker, samples.state, samples.bent)
    if method == "dop853":
        RigidStepper(walker, tolerances).solve_starts(strike_section(walker), [], z)


def compile_contact(method: str, config: Config) -> None:
    """Compile the kernels of the contact model, if the config has one, by simulating the beginning of a walk."""
    from walkerlab.physics.hybrid.contact_result import sample_energies, sample_feet
    from walkerlab.physics.mechanics.rigid import group_bodies
    from walkerlab.physics.solvers.registry import Tolerances
    from walkerlab.scene.contact import contact_scene, start_state

    if config.contact is None:
        return
    scene = contact_scene(config, config.walker.leg_length_m * 2.0 * float(np.sin(HALF_ANGLE)))
    places = group_bodies(scene.assembly).names
    angles = [HALF_ANGLE if name == "2" else -HALF_ANGLE if name.startswith("1") else 0.0 for name in places]
    standing = start_state(scene, (*angles, *(0.0 for _ in places)))
    walk = scene.walk(standing, 1, Tolerances(method, 1e-3, 1e-3, COMPILING_BUDGET), scene.ground.frame.pendulum_time)
    assert walk.samples is not None
    sample_energies(scene.walker, walk.samples)
    sample_feet(scene.walker, walk.samples)


def compile_plain_systems(config: Config) -> None:
    """Compile the functions that solvers without our events call. `stability` compares contact walks with theirs."""
    from walkerlab.physics.ground.on_pads import OnPads
    from walkerlab.physics.ground.walker import place_on_ground
    from walkerlab.physics.solvers.scipy_methods import right_hand_side
    from walkerlab.physics.solvers.semi_implicit_euler import semi_implicit_euler
    from walkerlab.scene.contact import contact_scene

    if config.contact is None:
        return
    scene = contact_scene(config, config.walker.leg_length_m * 2.0 * float(np.sin(HALF_ANGLE)))
    system = OnPads(place_on_ground(scene.walker, (True, True)), scene.ground.terrain)
    y = np.zeros(scene.walker.size)
    right_hand_side(system, 0.0, y, np.empty_like(y))
    semi_implicit_euler(system, y, np.empty_like(y), 0.0, 1e-4, 1)


def compile_lanes(config: Config) -> None:
    """Compile the kernels of basins, which simulate walks on straight legs from several starts at once."""
    from walkerlab.physics.hybrid.rigid_lanes import two_legs
    from walkerlab.physics.orbits.basin import SECTION_SIZE, Attractors, walk_to_attractor
    from walkerlab.scene.rigid import rigid_walker

    walker = two_legs(rigid_walker(config))
    if walker is not None:
        walk_to_attractor(walker, Attractors(), np.zeros((1, SECTION_SIZE)), 1)


PARTS: tuple[Callable[[Config], None], ...] = (
    *(partial(model, method) for method, model in product(COMPILED_METHODS, (compile_contact, compile_rigid))),
    compile_plain_systems,
    compile_lanes,
)
"""Functions that each compile some of a config's kernels, the slowest first."""


def compile_part(part: Callable[[Config], None], config: Config) -> set[str]:
    """Compile some kernels of a config, and return the names of their files."""
    from walkerlab.physics.compiler import files_in_use

    part(config)
    return set(files_in_use)


def compile_ahead(configs: Iterable[Config], jobs: int) -> set[str]:
    """Compile the kernels of these configs, unless the package or the cache already has them. Return the names of the
    files of all kernels."""
    calls = [partial(compile_part, part, config) for config, part in product(configs, PARTS)]
    return set[str]().union(*map_in_order(calls, jobs))


def build(folder: str) -> None:
    """Write the machine code of all built-in configs into a folder of the package that is being built."""
    began = time.monotonic()
    target = kernel_cache.build_target()
    if target is None:
        print("walkerlab: no kernels are built for this platform; they compile at run time")
        return
    os.environ["NUMBA_CPU_NAME"], os.environ["NUMBA_CPU_FEATURES"] = target[0], ""
    names = sorted(builtin_names(), key=lambda name: (name != DEFAULT, name))
    files = compile_ahead([load(Path(name), ()).config for name in names], jobs=os.cpu_count() or 1)
    about = write_machine_code(Path(folder), files)
    versions = ", ".join(f"{name} {about[name]}" for name in ("Python", "numba", "llvmlite", "processor"))
    print(f"walkerlab: {len(files)} kernels built in {time.monotonic() - began:.0f} s ({versions})", flush=True)


def write_machine_code(folder: Path, names: Iterable[str]) -> dict[str, Any]:
    """Copy files from the cache to a folder of the package. Store and return the versions and processor they need."""
    from walkerlab.physics.compiler import strip_bitcode

    folder.mkdir(exist_ok=True)
    processor, features = kernel_cache.build_target() or ("", ())
    for name in sorted(names):
        (folder / name).write_bytes(strip_bitcode(kernel_cache.cache_folder() / name))
    about = {**kernel_cache.circumstances(), "processor": processor, "features": features}
    (folder / kernel_cache.ABOUT).write_text(json.dumps(about, indent=1))
    return about
