"""Find and keep results in a run's folder or in memory, and compute the identities that show which are up to date."""

import json
import mmap
import os
import shutil
from collections import OrderedDict
from collections.abc import Mapping, Set
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

from walkerlab.code_digest import Sources, digest_of
from walkerlab.config.reads import slice_of
from walkerlab.config.schema import Config
from walkerlab.extensions import WORDS, code_by_word, extensions
from walkerlab.pipeline.plan.graph import PIPELINE, Graph
from walkerlab.pipeline.plan.stage import Stage
from walkerlab.pipeline.store import artifact, files, provenance, runs
from walkerlab.pipeline.store.artifact import Identity, Lookup, Stored, broken_file, changed_parts
from walkerlab.pipeline.store.content import Content
from walkerlab.pipeline.store.provenance import Provenance


class Keys:
    """Computes the identities of results. Whatever does not depend on the config is computed once per stage."""

    def __init__(self, graph: Graph = PIPELINE) -> None:
        """Create an empty cache of digests, which are computed on first use."""
        self.graph = graph
        self._sources = Sources()
        self._digests: dict[tuple[str, ...], str] = {}

    def compute_keys(self, config: Config, target: str) -> dict[str, str]:
        """Return the keys of a stage and of all its inputs, by stage.

        Raises the errors of `Graph.needed_in_memory`.
        """
        keys: dict[str, str] = {}
        for stage in self.graph.needed_in_memory(target, config):
            input_keys = {name: keys[name] for name in stage.inputs(config)}
            keys[stage.name] = self.identity(stage, config, input_keys).key
        return keys

    def identity(self, stage: Stage, config: Config, input_keys: Mapping[str, str], again: bool = True) -> Identity:
        """Return the identity of a stage's result under a config.

        input_keys  keys of the inputs, by stage
        again       see `call_stage`; always true for results in folders
        """
        once = {} if again else {"again": False}
        dependencies = {**slice_of(config, stage.takes_under(config)), **stage.depends_on(config), **once}
        code_digest = self.code_digest(stage.name, added_code(stage, dependencies))
        return Identity(stage.name, dependencies, input_keys, code_digest)

    def code_digest(self, target: str, added: Set[str] = frozenset()) -> str:
        """Return the digest of a stage's code and of the code of extensions that it uses. It is computed at the first
        call."""
        used = (target, *sorted(added))
        if used not in self._digests:
            modules = {code.partition(":")[0] for code in added}
            digest = self._sources.code_digest(self.graph[target].module, *modules)
            self._digests[used] = digest_of((code, digest.encode()) for code in used) if added else digest
        return self._digests[used]


def added_code(stage: Stage, own: Mapping[str, Any]) -> set[str]:
    """Return the code of extensions, as "module:name", that a stage's result depends on.

    This is the code of the walkers, laws and equations named in `own`, which holds the stage's part of the config and
    its other dependencies. For drawings, the code of everything drawn is added.
    """
    text = json.dumps(own)
    # If a word happens to be the value of another key, the identity contains unnecessary code, which does no harm.
    used = {code for key in WORDS for word, code in code_by_word(key).items() if json.dumps(word) in text}
    if stage.draws:
        used |= {code for extension in extensions().values() for code in extension.drawing_code()}
    return used


Action = Literal["reuse", "run", "leave out"]

UP_TO_DATE = "up to date"
REMEMBERED = 256
"""Number of results kept in memory. Keeping some saves time, because neighbouring points of a sweep often share
inputs."""


@dataclass(frozen=True)
class Step:
    """Planned or completed action for one stage."""

    stage: Stage
    action: Action
    reason: str  # reason for the action
    identity: Identity | None = None  # identity of the stage's result; None if the stage is left out
    found: Content | None = None  # the stored result if it is intact, whether up to date or outdated
    damaged: Path | None = None  # file of the stored result, if it is damaged
    origin: Path | None = None  # file of the result to reuse, if it is in another run's folder
    wall_s: float = 0.0  # run time; 0 if the stage has not run


class FolderResults:
    """Results in a run's folder.

    elsewhere  whether to reuse equal results from other run folders
    keys       builds the identities of results
    folder     path of the run's folder
    """

    def __init__(self, folder: runs.RunFolder, graph: Graph = PIPELINE, elsewhere: bool = True) -> None:
        """Store the arguments without reading a file."""
        self.run = folder
        self.folder = folder.path
        self.elsewhere = elsewhere
        self.keys = Keys(graph)
        self._begun: dict[str, tuple[Provenance, files.Checkpoint]] = {}

    def find(self, stage: Stage, identity: Identity, inputs: Mapping[str, Content], force: bool) -> Step:
        """Decide whether to reuse a stage's result or to run the stage. With `force` the stage always runs."""
        path = self.run.artifact(stage.name)
        verdict = artifact.check(path, identity.key, stage.name)
        stored = verdict.artifact
        damaged = path if verdict.damaged else None
        why = "--force" if force else self._why_outdated(stage, identity, verdict, inputs)
        if not why and stored is not None:
            reason = UP_TO_DATE if stored.no_answer is None else f"no answer: {stored.no_answer.message}"
            return Step(stage, "reuse", reason, identity, stored)
        # A drawing is never taken from another folder, because it consists of more files than the artifact.
        looks = self.elsewhere and not force and not stage.draws
        match = find_elsewhere(self.run, stage.name, identity.key) if looks else None
        if match is not None and not recomputed_input(stage, match[1], inputs):
            origin, result = match
            return Step(stage, "reuse", f"the same as in {origin.parent}", identity, result, damaged, origin)
        return Step(stage, "run", why, identity, stored, damaged)

    def take_over(self, step: Step) -> None:
        """Link or copy the file of a result into this folder if the step reuses it from another run.

        Sharing is safe, since artifacts are replaced but never modified. Raises StorageError if neither works.
        """
        if step.origin is not None:
            with files.replacing(self.run.artifact(step.stage.name)) as temporary:
                try:
                    os.link(step.origin, temporary)
                except OSError:
                    shutil.copyfile(step.origin, temporary)

    def begin(self, step: Step, config: Config, inputs: Mapping[str, Content], force: bool) -> Mapping[str, Any]:
        """Prepare to store a result, and return the stage's optional arguments (see `call_stage`).

        With `force`, drop the checkpoint of an interrupted run.
        """
        stage = step.stage
        identity = step.identity
        assert identity is not None, "a stage that is left out does not run"
        checkpoint = files.Checkpoint(self.run.checkpoint(stage.name), identity.key)
        if force:
            checkpoint.forget()
        digests = {name: input_digest(stage, result) for name, result in inputs.items()}
        self._begun[stage.name] = provenance.begin(config, digests), checkpoint
        return {"checkpoint": checkpoint, "folder": self.folder}

    def keep(self, step: Step, answer: Content, awaited: bool) -> Stored:  # noqa: ARG002
        """Store a result and remove its checkpoint.

        Raises StorageError if that fails.
        """
        origin, checkpoint = self._begun.pop(step.stage.name)
        assert step.identity is not None, "a stage that is left out does not run"
        stored = artifact.write(self.run.artifact(step.stage.name), answer, step.identity, origin.finish())
        checkpoint.forget()
        return stored

    def _why_outdated(self, stage: Stage, identity: Identity, verdict: Lookup, inputs: Mapping[str, Content]) -> str:
        """Return why a stage has to run, or '' if its result is current."""
        stored = verdict.artifact
        if not verdict.accepted or stored is None:
            changes = changed_parts(stored.identity, identity) if stored is not None else []
            return ", ".join(changes) or verdict.reason
        return broken_file(self.folder, stored) or recomputed_input(stage, stored, inputs)


def recomputed_input(stage: Stage, stored: Stored, inputs: Mapping[str, Content]) -> str:
    """Say which input was recomputed with different content since the result was stored, or return '' if none was."""
    for name, result in inputs.items():
        if stored.provenance.input_digests.get(name) != input_digest(stage, result):
            return f"input {name} was recomputed"
    return ""


def input_digest(stage: Stage, result: Content) -> str:
    """Return the digest of an input, as recorded in a result.

    Drawings also show run times, so for them it covers the whole file.
    """
    return result.seal if stage.draws and isinstance(result, Stored) else result.digest()


def find_elsewhere(folder: runs.RunFolder, stage: str, key: str) -> tuple[Path, Stored] | None:
    """Find a result with this key in another run folder, and return its path and content, or None. Damaged files are
    ignored."""
    try:
        names = sorted(entry.name for entry in os.scandir(folder.runs_dir) if entry.is_dir())
    except OSError:
        return None
    for path in (runs.RunFolder(folder.runs_dir, name).artifact(stage) for name in names if name != folder.name):
        if mentions(path, key):
            verdict = artifact.check(path, key)
            if verdict.accepted and verdict.artifact is not None:
                return path, verdict.artifact
    return None


def mentions(path: Path, key: str) -> bool:
    """Whether a file contains a key: a cheap test before the file is read and verified."""
    try:
        with path.open("rb") as file, mmap.mmap(file.fileno(), 0, access=mmap.ACCESS_READ) as data:
            return data.find(key.encode()) >= 0
    except (OSError, ValueError):  # the file is missing, not a regular file, or empty
        return False


class LoadedCodeKeys(Keys):
    """Builds identities for this process only. They need no code digest, because loaded code does not change."""

    def code_digest(self, target: str, added: Set[str] = frozenset()) -> str:  # noqa: ARG002
        return ""


class MemoryResults:
    """Results in memory. Only the latest ones that other stages need are kept."""

    folder = None

    def __init__(self, graph: Graph = PIPELINE) -> None:
        self.keys = LoadedCodeKeys(graph)
        self._kept: OrderedDict[str, Content] = OrderedDict()

    def find(self, stage: Stage, identity: Identity, inputs: Mapping[str, Content], force: bool) -> Step:  # noqa: ARG002
        """Return a step that reuses a result in memory, or runs the stage."""
        if identity.key not in self._kept:
            return Step(stage, "run", artifact.NOT_THERE, identity)
        self._kept.move_to_end(identity.key)
        return Step(stage, "reuse", UP_TO_DATE, identity, self._kept[identity.key])

    def take_over(self, step: Step) -> None:
        """Do nothing: there is no other folder."""

    def begin(self, step: Step, config: Config, inputs: Mapping[str, Content], force: bool) -> Mapping[str, Any]:  # noqa: ARG002
        """Return a checkpoint that is kept only in memory."""
        return {"checkpoint": files.Checkpoint(None, "")}

    def keep(self, step: Step, answer: Content, awaited: bool) -> Content:
        """Keep a result if another stage waits for it."""
        if awaited and step.identity is not None:
            self._kept[step.identity.key] = answer
            if len(self._kept) > REMEMBERED:
                self._kept.popitem(last=False)
        return answer


Results = FolderResults | MemoryResults
