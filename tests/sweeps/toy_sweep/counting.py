"""A stage that keeps parts of its result."""

from walkerlab.store.content import Content


def run(config, inputs, progress, jobs, parts):
    for number in range(config.seed):
        parts.keep(str(number), [float(number)])
    return Content({}, {"total": sum(sum(numbers) for numbers in parts.kept.values()), "jobs": jobs})
