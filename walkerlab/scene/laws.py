"""Find the laws of ground and hinges that a config names, whether built in or added by extensions."""

from typing import Any

from walkerlab.config.contact import Contact
from walkerlab.errors import ConfigError
from walkerlab.extensions import code_by_word, load
from walkerlab.physics.kernels import LawKind
from walkerlab.physics.mechanics.hinges import HINGE_LAWS
from walkerlab.scene.parts import AnyWalker


def hinge_law_of(walker: AnyWalker) -> Any:
    return law_class(HINGE_LAWS, walker.hip.hinge_law)


def law_class(kind: LawKind, word: str) -> Any:
    """Return the class of the law that a config names.

    Raises ConfigError if a law that an extension added is incomplete.
    """
    try:
        law = kind.laws.get(word) or load(code_by_word(kind.key)[word])
    # The code may be that of another package, and raise any error.
    except Exception as error:
        raise ConfigError(
            f"{kind.key}: the code of '{word}' cannot be imported: {type(error).__name__}: {error}.",
            "`walkerlab extensions` shows which package adds it.",
        ) from error
    if missing := missing_members(law, kind):
        named = f"the {kind.key.removesuffix('_law').replace('_', '-')} law {law.__name__} ('{word}')"
        raise ConfigError(f"{named} is incomplete: it lacks {', '.join(missing)}.", where_to_look(kind))
    return law


def ground_law(kind: LawKind, contact: Contact) -> Any:
    """Create the law of a contact block in SI. Raises ConfigError as `law_class` does."""
    law = law_class(kind, getattr(contact, kind.key))
    try:
        return law.from_contact(contact)
    except (TypeError, AttributeError) as error:
        raise ConfigError(f"{error}.", where_to_look(kind)) from error


def where_to_look(kind: LawKind) -> str:
    return f"{kind.protocol.__name__} in {kind.protocol.__module__} lists the members of a law."


def missing_members(law: type, kind: LawKind) -> list[str]:
    """List what the class of a law lacks: members of the protocol, and cases registered for it in functions."""
    members = [name for name in vars(kind.protocol) if not name.startswith("_")]
    missing = [name for name in members if not hasattr(law, name)]
    if kind.derived and not issubclass(law, kind.protocol):
        missing = [f"the base class {kind.protocol.__name__}"]
    # A law with one of these functions needs the others, too. For example, counted events must also be sampled.
    together = kind.together if any(law in function for function in kind.together) else ()
    cases = [function for function in (*kind.required, *together) if law not in function]
    return missing + [f"a case @{function.__name__}.case({law.__name__})" for function in cases]
