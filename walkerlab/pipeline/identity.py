"""What a stage's result is determined by, whether it is stored, a point of a sweep, or an answer in memory."""

from collections.abc import Mapping
from typing import Any

from walkerlab.config.canonical import slice_of
from walkerlab.config.overlay import over_paper
from walkerlab.config.schema import Config
from walkerlab.pipeline.graph import Stage
from walkerlab.sources import Sources
from walkerlab.store.key import Identity


class Identities:
    """Identities of results; what does not depend on the config is looked up once for each stage."""

    def __init__(self) -> None:
        """Read no code yet."""
        self._sources = Sources()
        self._digests: dict[str, str] = {}
        self._fixed: dict[str, dict[str, Any]] = {}

    def of(self, stage: Stage, config: Config, input_keys: Mapping[str, str]) -> Identity:
        """The identity of a stage's result under a config.

        input_keys  keys of the results that it takes, by stage
        """
        if stage.name not in self._fixed:
            # as `paper` what its own cases take of the built-in config, as `programs` the versions of those it drives
            fixed = self._fixed[stage.name] = {}
            if stage.takes_of_paper is not None:
                fixed["paper"] = slice_of(over_paper({}), stage.takes_of_paper)
            if stage.programs is not None:
                fixed["programs"] = dict(stage.programs())
        own = slice_of(config, stage.takes_under(config))
        return Identity(stage.name, {**own, **self._fixed[stage.name]}, input_keys, self.code_digest(stage))

    def code_digest(self, stage: Stage) -> str:
        """The digest of a stage's code, as it was when it was first asked for."""
        if stage.name not in self._digests:
            self._digests[stage.name] = self._sources.code_digest(stage.module)
        return self._digests[stage.name]
