"""What would happen, and why: for each stage whether its result is reused, made, or left out."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Literal

from walkerlab.config.schema import Config
from walkerlab.pipeline.graph import NO_CONTACT, PIPELINE, Graph, Stage
from walkerlab.pipeline.identity import Keys
from walkerlab.scene.left_out import LeftOut
from walkerlab.store import artifact
from walkerlab.store.artifact import Stored, Verdict
from walkerlab.store.elsewhere import find_elsewhere
from walkerlab.store.index import broken_file
from walkerlab.store.key import Identity, changed_parts
from walkerlab.store.runfolder import RunFolder

Action = Literal["reuse", "run", "leave out"]


UP_TO_DATE = "up to date"
STILL_COMPUTED = "still being computed"
"""Why a drawing made early has to do without a result."""


def left_out(stage: str, why: str) -> LeftOut:
    """A stage that does not run."""
    return LeftOut(stage, why, "loading and compiling contact code" if why == NO_CONTACT else "")


@dataclass(frozen=True)
class Step:
    """What happens with one stage.

    reason    why, in words
    identity  what its result is determined by; None if it is left out
    found     what is stored now, if it is intact: the result to reuse, or an outdated one
    damaged   a file is stored that is not to be trusted
    origin    its file, if that lies in another run's folder
    """

    stage: Stage
    action: Action
    reason: str
    identity: Identity | None = None
    found: Stored | None = None
    damaged: bool = False
    origin: Path | None = None


@dataclass
class Planner:
    """Decides on stages one after another, knowing what became of those before.

    force      every stage runs that is not left out
    elsewhere  results in other run folders are reused too
    left_out   the stages that are left out so far, and why
    results    those that are there, by stage
    """

    config: Config
    folder: RunFolder
    graph: Graph = PIPELINE
    force: bool = False
    elsewhere: bool = True
    left_out: dict[str, str] = field(default_factory=dict, init=False)
    results: dict[str, Stored] = field(default_factory=dict, init=False)
    _keys: dict[str, str] = field(default_factory=dict, init=False)

    def __post_init__(self) -> None:
        """Read no code yet."""
        self._identities = Keys(self.graph)

    def plan(self, stages: Sequence[Stage]) -> tuple[Step, ...]:
        """Decide on stages in the order in which they run, taking it that each goes as decided."""
        steps = []
        for stage in stages:
            step = self.decide(stage, stages)
            if not (stage.optional and step.action == "run"):  # what is optional is counted on once it is there
                self.expect(step)
            steps.append(step)
        return tuple(steps)

    def decide(self, stage: Stage, planned: Sequence[Stage]) -> Step:
        """What is to happen with a stage, given what became of its inputs.

        Of the results that it takes if they are current those are looked at that are not planned for themselves; one
        that is damaged is not passed over in silence.
        """
        for name in stage.if_current:
            if self.graph[name] not in planned:
                step = self._judge(self.graph[name], force=False)
                if step.action == "reuse" and step.origin is None:
                    self.expect(step)
                elif step.damaged:
                    self.left_out[name] = f"its result is {step.reason}; {self._command_of(name)} recomputes it"
        return self._judge(stage, self.force)

    def expect(self, step: Step) -> None:
        """Take it that a step goes as decided: what is to run will have a result."""
        if step.identity is None:
            self.left_out[step.stage.name] = step.reason
        elif step.action == "reuse" and step.found is not None:
            self.settle(step.stage, step.found)
        else:
            self._keys[step.stage.name] = step.identity.key

    def settle(self, stage: Stage, result: Stored) -> None:
        """Take note of a stage's result, which may be that there is no answer."""
        self.results[stage.name] = result
        if result.complete:
            self._keys[stage.name] = result.identity.key
        else:
            self.left_out[stage.name] = no_answer(result)

    def inputs(self, stage: Stage) -> dict[str, Stored]:
        """The results that a stage gets: those it needs, and those it takes if they are there."""
        there = self.results.keys() - self.left_out.keys()
        return {name: self.results[name] for name in stage.results(self.config) if name in there}

    def missing_inputs(self, stage: Stage) -> tuple[LeftOut, ...]:
        """The results that a stage does without, and why."""
        missing = (name for name in stage.results(self.config) if name not in self._keys)
        return tuple(left_out(name, self._why_absent(name)) for name in missing)

    def _judge(self, stage: Stage, force: bool) -> Step:
        why = stage.why_unsuited(self.config)
        for name in () if stage.draws else stage.inputs(self.config):
            if why is None and name in self.left_out:
                why = f"it needs {name}: {self.left_out[name]}"
        if why is not None:
            return Step(stage, "leave out", why)
        keys = {name: self._keys[name] for name in stage.results(self.config) if name in self._keys}
        # what a drawing says about results left out depends on why they are
        keys |= {absent.what: f"left out: {absent.why}" for absent in self.missing_inputs(stage)}
        identity = self._identities.identity(stage, self.config, keys)
        verdict = artifact.check(self.folder.artifact(stage.name), identity.key, stage.name)
        reason = "--force" if force else self._why_run(stage, identity, verdict)
        if reason is None and verdict.artifact is not None:
            kept = UP_TO_DATE if verdict.artifact.complete else f"no answer: {no_answer(verdict.artifact)}"
            return Step(stage, "reuse", kept, identity, verdict.artifact)
        elsewhere = None if force else self._elsewhere(stage, identity)
        if elsewhere is not None:
            origin, result = elsewhere
            reason = f"the same as in {origin.parent}"
            return Step(stage, "reuse", reason, identity, result, verdict.damaged, origin)
        return Step(stage, "run", reason or "--force", identity, verdict.artifact, verdict.damaged)

    def _elsewhere(self, stage: Stage, identity: Identity) -> tuple[Path, Stored] | None:
        """The result of a stage in another run folder; drawings stand beside their artifact and are made anew."""
        if not self.elsewhere or stage.draws:
            return None
        found = find_elsewhere(self.folder, stage.name, identity.key)
        return found if found is not None and self._made_anew(stage, found[1]) is None else None

    def _why_absent(self, name: str) -> str:
        command = self._command_of(name)
        if self.graph[name].optional:
            return self.left_out.get(name, f"it was not asked for; {command} computes it")
        none_yet = self.graph[name].why_unsuited(self.config) or f"no current result; {command} computes one"
        return self.left_out.get(name, none_yet)

    def _command_of(self, name: str) -> str:
        return f"`walkerlab {self.graph[name].command}`"

    def _why_run(self, stage: Stage, identity: Identity, verdict: Verdict) -> str | None:
        found = verdict.artifact
        if not verdict.accepted or found is None:
            changes = changed_parts(found.identity, identity) if found is not None else []
            return ", ".join(changes) or verdict.reason
        broken = broken_file(self.folder.path, found)
        if broken is not None:
            return broken
        return self._made_anew(stage, found)

    def _made_anew(self, stage: Stage, found: Stored) -> str | None:
        """What of a result's inputs has another content than it was made with, in words."""
        for name, result in self.inputs(stage).items():
            if found.provenance.input_digests.get(name) != input_digest(stage, result):
                return f"input {name} was recomputed"
        return None


def input_digest(stage: Stage, result: Stored) -> str:
    """What a stage's result records of an input: numbers follow from its content, drawings also show its timings."""
    return result.seal if stage.draws else result.digest()


def no_answer(result: Stored) -> str:
    """What the partial result of a stage says about there being no answer."""
    said: dict[str, Any] = result.summary.get("no_answer", {})
    return str(said.get("message", "no answer"))


def survey(config: Config, folder: RunFolder, graph: Graph = PIPELINE) -> tuple[Step, ...]:
    """What is stored in a run's own folder, and what running each stage there is would do; touches nothing."""
    return Planner(config, folder, graph, elsewhere=False).plan(graph.stages)
