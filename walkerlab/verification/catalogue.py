"""The catalogue of cases: read, typed by the schema, and turned into configs."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any, Final

from walkerlab.config.overlay import over_paper
from walkerlab.config.reader import read
from walkerlab.config.schema import Config
from walkerlab.config.stability import Case
from walkerlab.config.tree import plain
from walkerlab.errors import ConfigError

CATALOGUE: Final = Path(__file__).parent / "catalogue.yaml"
NAME_OF_ITS_OWN: Final = "Give yours a name of its own."


def shipped() -> tuple[Case, ...]:
    """The cases that come with the package."""
    families = listed(CATALOGUE).items()
    return without_doubles([Case.model_validate({"family": name, **one}) for name, cases in families for one in cases])


def listed(path: Path) -> Any:
    """What a catalogue says, in plain values."""
    root = read(path.read_text(encoding="utf-8"), path.name)
    assert root is not None, "a catalogue is not empty"
    return plain(root)


def judged(own: Sequence[Case], catalogue: Sequence[Case] | None = None) -> tuple[Case, ...]:
    """The cases of a catalogue, the package's unless told, and those of a config; ConfigError if two have one name."""
    catalogue = shipped() if catalogue is None else catalogue
    taken = {case.name for case in catalogue} & {case.name for case in own}
    if taken:
        raise ConfigError(f"The catalogue has cases named {', '.join(sorted(taken))}.", NAME_OF_ITS_OWN)
    return (*catalogue, *without_doubles(own))


def without_doubles(cases: Sequence[Case]) -> tuple[Case, ...]:
    """The cases; ConfigError if two have one name."""
    names = [case.name for case in cases]
    doubled = sorted({name for name in names if names.count(name) > 1})
    if doubled:
        raise ConfigError(f"More than one case is named {', '.join(doubled)}.", NAME_OF_ITS_OWN)
    return tuple(cases)


def config_of(case: Case) -> Config:
    """The paper's config with the case's lines over it; ConfigError if they are no config."""
    return over_paper(case.config, f"case {case.name}")
