"""Laws that a config names: those of the ground and of the hinges, built-in ones and those of extensions."""

from typing import Any, Final, NamedTuple

from walkerlab.config.contact import Contact
from walkerlab.errors import ConfigError
from walkerlab.extensions import declared, load
from walkerlab.physics.ground.friction import (
    FRICTION_LAWS,
    FrictionLaw,
    friction_coefficient,
    sample_switching,
    switching_count,
)
from walkerlab.physics.ground.normal_force import (
    NORMAL_LAWS,
    NormalLaw,
    elastic_energy,
    normal_force,
    release_function,
)
from walkerlab.physics.mechanics.hinges import HINGE_LAWS, SpringDamper, hinge_energy, hinge_torque


class LawKind(NamedTuple):
    """Force laws that a config key can select."""

    laws: dict[str, Any]  # built-in classes by word
    protocol: type
    required: tuple[Any, ...]  # functions of which each law needs a case
    together: tuple[Any, ...] = ()  # functions of which a law has cases of all or of none


LAW_KINDS: Final = {
    "normal_force": LawKind(NORMAL_LAWS, NormalLaw, (normal_force, release_function, elastic_energy)),
    "friction": LawKind(FRICTION_LAWS, FrictionLaw, (friction_coefficient,), (switching_count, sample_switching)),
    "hinge_law": LawKind(HINGE_LAWS, SpringDamper, (hinge_torque, hinge_energy)),
}


def law_class(kind: str, word: str) -> Any:
    """Return the class of the law that a config names, of a kind in `LAW_KINDS`.

    Raises ConfigError if a law that an extension added is incomplete.
    """
    laws = LAW_KINDS[kind]
    try:
        law = laws.laws.get(word) or load(declared(kind)[word])
    except (ImportError, AttributeError) as error:
        raise ConfigError(f"{error}.", where_to_look(laws)) from error
    if missing := missing_members(law, laws):
        name = kind.removesuffix("_law").replace("_", "-")
        named = f"the {name} law {law.__name__} ('{word}')"
        raise ConfigError(f"{named} is incomplete: it lacks {', '.join(missing)}.", where_to_look(laws))
    return law


def ground_law(kind: str, contact: Contact) -> Any:
    """Create the law that a contact block in SI names. Raises ConfigError as `law_class` does."""
    law = law_class(kind, getattr(contact, kind))
    try:
        return law.from_contact(contact)
    except (TypeError, AttributeError) as error:
        raise ConfigError(f"{error}.", where_to_look(LAW_KINDS[kind])) from error


def where_to_look(kind: LawKind) -> str:
    return f"{kind.protocol.__name__} in {kind.protocol.__module__} lists the members of a law."


def missing_members(law: type, kind: LawKind) -> list[str]:
    """List what a law's class lacks: members of its protocol, and registered cases of functions."""
    members = [name for name in vars(kind.protocol) if not name.startswith("_")]
    missing = [name for name in members if not hasattr(law, name)]
    # A law with one of these functions needs the others: events that are counted must also be sampled.
    together = kind.together if any(law in function for function in kind.together) else ()
    cases = [function for function in (*kind.required, *together) if law not in function]
    return missing + [f"a case @{function.__name__}.case({law.__name__})" for function in cases]
