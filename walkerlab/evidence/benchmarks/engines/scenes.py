"""Scene for other engines, and checks for walkers that they do not support."""

from walkerlab.config.reads import ContactConfig
from walkerlab.errors import ConfigError
from walkerlab.exchange.engine_scene import EngineScene, engine_scene
from walkerlab.exchange.planar import SMALLEST_BALL_M
from walkerlab.physics.ground.knees import IdealLock
from walkerlab.physics.ground.terrain import STANCE_FOOT
from walkerlab.physics.hybrid.contact_state import knees_at_start
from walkerlab.physics.solvers.system import State
from walkerlab.scene.contact import knee_rules
from walkerlab.scene.parts import assembly_of


def supported_scene(
    config: ContactConfig, rigid_step_length_m: float, rigid_state: State, asymmetry: float = 0.0
) -> EngineScene:
    """Return a config's scene for engines, see `engine_scene`.

    Raises ConfigError for a walker that other engines do not support.
    """
    assembly = assembly_of(config.walker)
    if assembly.couplings:
        raise ConfigError(
            "engines: a torso held on the bisector is a constraint that the engine models do not support.",
            "Choose a walker without a torso.",
        )
    if assembly.knees and not isinstance(knee_rules(config.walker).stop, IdealLock):
        raise ConfigError(
            "engines: the engine models do not support a knee's compliant stop.", "Choose walker.knee.lock: ideal."
        )
    points = [foot.radius_m < SMALLEST_BALL_M for foot in assembly.feet]
    if any(points) and not all(points):
        raise ConfigError(
            "engines: a point foot becomes a ball on ground that is lower by its radius, and the other foot is round.",
            f"Set the radius of the point foot to {SMALLEST_BALL_M:g} m, or make both feet points.",
        )
    scene = engine_scene(config, rigid_step_length_m, rigid_state, asymmetry)
    return scene.lock_knees(knees_at_start(scene.ours, STANCE_FOOT, scene.start))
