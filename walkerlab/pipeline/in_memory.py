"""A stage computed in memory, with what it needs and without a file: points of a sweep, objects of the Python API."""

from collections import OrderedDict

from walkerlab.config.schema import Config
from walkerlab.errors import NoAnswer
from walkerlab.pipeline.graph import PIPELINE, Graph
from walkerlab.pipeline.progress import Progress, Silent
from walkerlab.pipeline.task import StageAnswer, task_of
from walkerlab.store.content import Content
from walkerlab.store.parts import Parts

REMEMBERED = 256
"""Results of needed stages that are kept: those of neighbouring points are often the same."""


class InMemory:
    """Computes stages; remembers the results of those that others need."""

    def __init__(self, graph: Graph = PIPELINE, remembered: int = REMEMBERED) -> None:
        """Nothing is computed yet."""
        self.graph = graph
        self.remembered = remembered
        self._inputs: OrderedDict[tuple[str, bool], StageAnswer] = OrderedDict()

    def answer(
        self,
        config: Config,
        target: str,
        keys: dict[str, str],
        progress: Progress | None = None,
        *,
        again: bool = True,
        anew: bool = True,
    ) -> StageAnswer:
        """The answer of a stage under a config, as the stage gives it when it is run.

        keys   of the stage and what it needs, from `Keys.of`
        again  whether walks are taken a second time for their numerical error
        anew   whether the stage itself is computed even where another one has needed it already
        """
        progress = progress or Silent()
        results: dict[str, Content] = {}
        for stage in self.graph.needed_for(target, config):
            key = (keys[stage.name], again and (stage.walks or stage.follows))
            if key not in self._inputs or (anew and stage.name == target):
                inputs = {name: results[name] for name in stage.inputs(config)}
                task = task_of(stage, config, inputs, jobs=1, parts=Parts(None, ""), again=again)
                answer = task.run(progress)
                if stage.name == target:
                    return answer
                self._inputs[key] = answer
                if len(self._inputs) > self.remembered:
                    self._inputs.popitem(last=False)
            elif stage.name == target:
                return self._inputs[key]
            self._inputs.move_to_end(key)
            found = self._inputs[key]
            if found.no_answer is not None:
                said = NoAnswer(f"it needs {stage.name}: {found.no_answer.message}", found.no_answer.advice)
                return StageAnswer(Content(), said)
            results[stage.name] = found.content
        raise AssertionError("a stage needs itself")
