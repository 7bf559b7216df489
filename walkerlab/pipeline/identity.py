"""What a stage's result is determined by, whether it is stored, a point of a sweep, or an answer in memory."""

from collections.abc import Mapping
from typing import Any

from walkerlab.config.canonical import slice_of
from walkerlab.config.overlay import paper_config_with
from walkerlab.config.schema import Config
from walkerlab.pipeline.graph import PIPELINE, Graph, Stage
from walkerlab.sources import Sources
from walkerlab.store.key import Identity


class Keys:
    """Identities of results, without looking at a file; what no config changes is looked up once for each stage."""

    def __init__(self, graph: Graph = PIPELINE) -> None:
        """Read no code yet."""
        self.graph = graph
        self._sources = Sources()
        self._digests: dict[str, str] = {}
        self._fixed: dict[str, dict[str, Any]] = {}

    def of(self, config: Config, target: str) -> dict[str, str]:
        """The key of a stage and of each that it needs, by name; ConfigError as `Graph.needed_in_memory` raises."""
        keys: dict[str, str] = {}
        for stage in self.graph.needed_in_memory(target, config):
            given = {name: keys[name] for name in stage.inputs(config)}
            keys[stage.name] = self.identity(stage, config, given).key
        return keys

    def identity(self, stage: Stage, config: Config, input_keys: Mapping[str, str], again: bool = True) -> Identity:
        """The identity of a stage's result under a config.

        input_keys  keys of the results that it takes, by stage
        again       whether its walks are taken a second time for their numerical error, as all that are stored
        """
        if stage.name not in self._fixed:
            # as `paper` what its own cases take of the built-in config, as `programs` the versions of those it drives
            fixed = self._fixed[stage.name] = {}
            if stage.takes_of_paper is not None:
                fixed["paper"] = slice_of(paper_config_with({}), stage.takes_of_paper)
            if stage.programs is not None:
                fixed["programs"] = dict(stage.programs())
        once = {} if again or not (stage.walks or stage.follows) else {"again": False}
        own = {**slice_of(config, stage.takes_under(config)), **self._fixed[stage.name], **once}
        return Identity(stage.name, own, input_keys, self.code_digest(stage.name))

    def code_digest(self, target: str) -> str:
        """The digest of a stage's code, as it was when it was first asked for."""
        if target not in self._digests:
            self._digests[target] = self._sources.code_digest(self.graph[target].module)
        return self._digests[target]
