"""Identities of stored, swept and in-memory results: the config slice, inputs and code that determine a result."""

import json
from collections.abc import Mapping, Set
from typing import Any

from walkerlab.code_digest import Sources, digest_of
from walkerlab.config.canonical import slice_of
from walkerlab.config.schema import Config
from walkerlab.extensions import WORDS, declared, extensions
from walkerlab.pipeline.plan.graph import PIPELINE, Graph
from walkerlab.pipeline.plan.stage import Stage
from walkerlab.pipeline.store.key import Identity


class Keys:
    """Builds identities of results. Parts that do not depend on the config are computed once per stage."""

    def __init__(self, graph: Graph = PIPELINE) -> None:
        """Start without digests, which are computed on first use."""
        self.graph = graph
        self._sources = Sources()
        self._digests: dict[tuple[str, ...], str] = {}

    def of(self, config: Config, target: str) -> dict[str, str]:
        """Return the keys of a stage and of all its inputs, by stage. Raises as `Graph.needed_in_memory` does."""
        keys: dict[str, str] = {}
        for stage in self.graph.needed_in_memory(target, config):
            input_keys = {name: keys[name] for name in stage.inputs(config)}
            keys[stage.name] = self.identity(stage, config, input_keys).key
        return keys

    def identity(self, stage: Stage, config: Config, input_keys: Mapping[str, str], again: bool = True) -> Identity:
        """Return the identity of a stage's result under a config.

        input_keys  keys of its inputs, by stage
        again       as for `call_stage`; true for every stored result
        """
        once = {} if again else {"again": False}
        own = {**slice_of(config, stage.takes_under(config)), **stage.depends_on(config), **once}
        return Identity(stage.name, own, input_keys, self.code_digest(stage.name, added_code(stage, own)))

    def code_digest(self, target: str, added: Set[str] = frozenset()) -> str:
        """Return the digest of a stage's code, and of code of extensions that it uses, computed at the first call."""
        used = (target, *sorted(added))
        if used not in self._digests:
            modules = {code.partition(":")[0] for code in added}
            digest = self._sources.code_digest(self.graph[target].module, *modules)
            self._digests[used] = digest_of((code, digest.encode()) for code in used) if added else digest
        return self._digests[used]


def added_code(stage: Stage, own: Mapping[str, Any]) -> set[str]:
    """Return the code of extensions, as "module:name", that a stage's result depends on.

    They are the laws named by words in its part of the config and what else it depends on, `own`, and for drawings
    everything that is drawn.
    """
    text = json.dumps(own)
    used = {code for key in WORDS for word, code in declared(key).items() if json.dumps(word) in text}
    if stage.draws:
        used |= {code for extension in extensions().values() for code in extension.views()}
    return used
