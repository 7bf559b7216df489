"""Decide for each stage of a pipeline whether to reuse its result, run it or leave it out."""

from collections.abc import Sequence

from walkerlab.config.schema import Config
from walkerlab.pipeline.plan.results import Results, Step
from walkerlab.pipeline.plan.stage import Stage, without_block
from walkerlab.pipeline.store.content import Content
from walkerlab.pipeline.store.key import Identity
from walkerlab.scene.omissions import LeftOut


class Planner:
    """Decides what to do with some stages under one config, knowing the results that exist so far.

    stages    stages to bring up to date, each after the stages that it needs
    force     run every stage that is not left out, even if its result is current
    again     whether to repeat walks at tighter tolerances to measure their numerical error
    answers   results so far, by stage
    left_out  reasons why stages are left out, by stage
    """

    def __init__(
        self, config: Config, results: Results, stages: Sequence[Stage], *, force: bool = False, again: bool = True
    ) -> None:
        """Store the arguments without reading anything."""
        self.config = config
        self.results = results
        self.stages = tuple(stages)
        self.graph = results.keys.graph
        self.force = force
        self.again = again
        self.answers: dict[str, Content] = {}
        self.left_out: dict[str, str] = {}
        self._keys: dict[str, str] = {}

    def plan(self) -> tuple[Step, ...]:
        """Decide for each stage, assuming that all succeed. This changes no file."""
        steps = []
        for stage in self.stages:
            step = self.decide(stage)
            if not (stage.only_by and step.action == "run"):  # an optional result counts only if it exists
                self.expect(step)
            steps.append(step)
        return tuple(steps)

    def decide(self, stage: Stage) -> Step:
        """Decide whether to reuse, run or leave out a stage, after the same decision for its inputs.

        Optional inputs outside this plan are looked up first; a damaged one is recorded as left out.
        """
        for name in stage.if_current:
            if self.graph[name] not in self.stages:
                step = self._judge(self.graph[name], force=False)
                if step.action == "reuse" and step.origin is None:
                    self.expect(step)
                elif step.damaged:
                    self.left_out[name] = f"its result is {step.reason}; {self._command_of(name)} recomputes it"
        return self._judge(stage, self.force)

    def expect(self, step: Step) -> None:
        """Record the expected outcome of a step, assuming that it succeeds."""
        if step.identity is None:
            self.left_out[step.stage.name] = step.reason
        elif step.action == "reuse" and step.found is not None:
            self.settle(step, step.found)
        else:
            self._keys[step.stage.name] = step.identity.key

    def settle(self, step: Step, answer: Content) -> None:
        """Record a stage's result, or the reason why it found no answer."""
        self.answers[step.stage.name] = answer
        if answer.no_answer is not None:
            self.left_out[step.stage.name] = answer.no_answer.message
        elif step.identity is not None:
            self._keys[step.stage.name] = step.identity.key

    def inputs(self, stage: Stage) -> dict[str, Content]:
        """Return the available results that a stage uses, required or optional, by stage."""
        available = self.answers.keys() - self.left_out.keys()
        return {name: self.answers[name] for name in stage.results(self.config) if name in available}

    def missing_inputs(self, stage: Stage) -> tuple[LeftOut, ...]:
        """Return the results that a stage lacks, with the reasons."""
        missing = (name for name in stage.results(self.config) if name not in self._keys)
        return tuple(omission_of(name, self._why_absent(name)) for name in missing)

    def _judge(self, stage: Stage, force: bool) -> Step:
        why = stage.why_unsuited(self.config)
        for name in () if stage.draws else stage.inputs(self.config):
            if why is None and name in self.left_out:
                why = f"it needs {name}: {self.left_out[name]}"
        if why is not None:
            return Step(stage, "leave out", why)
        return self.results.find(stage, self._identity(stage), self.inputs(stage), force)

    def _identity(self, stage: Stage) -> Identity:
        keys = {name: self._keys[name] for name in stage.results(self.config) if name in self._keys}
        # a drawing states why results are left out, so the reasons are part of its identity
        keys |= {absent.what: f"left out: {absent.why}" for absent in self.missing_inputs(stage)}
        return self.results.keys.identity(stage, self.config, keys, self.again)

    def _why_absent(self, name: str) -> str:
        command = self._command_of(name)
        if self.graph[name].only_by:
            return self.left_out.get(name, f"it was not requested; {command} computes it")
        none_yet = self.graph[name].why_unsuited(self.config) or f"no current result; {command} computes one"
        return self.left_out.get(name, none_yet)

    def _command_of(self, name: str) -> str:
        return f"`walkerlab {self.graph[name].command}`"


def omission_of(stage: str, why: str) -> LeftOut:
    """Describe a stage that is left out, with the reason and what that saves."""
    return LeftOut(stage, why, "loading and compiling contact code" if why == without_block("contact") else "")
