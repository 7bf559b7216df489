"""Laws of the ground by the words of a contact block, and what their classes must have."""

from typing import Any, Final, NamedTuple

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


class LawKind(NamedTuple):
    """Laws between which a key of the contact block chooses."""

    laws: dict[str, Any]  # classes by word
    protocol: type
    required: tuple[Any, ...]  # functions of which each law needs a case
    together: tuple[Any, ...] = ()  # functions of which a law has cases of all or of none


LAW_KINDS: Final = {
    "normal_force": LawKind(NORMAL_LAWS, NormalLaw, (normal_force, release_function, elastic_energy)),
    "friction": LawKind(FRICTION_LAWS, FrictionLaw, (friction_coefficient,), (switching_count, sample_switching)),
}


def create_law(key: str, word: str, contact: Any) -> Any:
    """Create the law that a contact block in SI names under a key.

    Raises TypeError if its class is incomplete.
    """
    law = LAW_KINDS[key].laws[word]
    missing = missing_members(law, LAW_KINDS[key])
    if missing:
        kind = key.replace("_", "-")
        raise TypeError(f"the {kind} law {law.__name__} ('{word}') is incomplete: it lacks {', '.join(missing)}")
    return law.from_contact(contact)


def missing_members(law: type, kind: LawKind) -> list[str]:
    """List what a law's class lacks: members of its protocol, and registered cases of functions."""
    members = [name for name in vars(kind.protocol) if not name.startswith("_")]
    missing = [name for name in members if not hasattr(law, name)]
    # A law with one of these functions needs the others: events that are counted must also be sampled.
    together = kind.together if any(law in function for function in kind.together) else ()
    cases = [function for function in (*kind.required, *together) if law not in function]
    return missing + [f"a case @{function.__name__}.case({law.__name__})" for function in cases]
