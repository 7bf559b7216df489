"""A stage that keeps a checkpoint of its result."""

from walkerlab.pipeline.store.content import Content


def run(config, inputs, progress, jobs, checkpoint):
    for number in range(config.seed):
        checkpoint.keep(str(number), [float(number)])
    return Content({}, {"total": sum(sum(numbers) for numbers in checkpoint.kept.values()), "jobs": jobs})
