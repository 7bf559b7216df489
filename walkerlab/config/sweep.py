"""The sweep block: one stage over many configs."""

from walkerlab.config.fields import Block, key

Values = str | list[float | int | bool | str]


class Sweep(Block):
    """Defaults of the options of `walkerlab sweep`."""

    stage: str = key("fixedpoint", "", "stage to run", bounds="any stage that draws no figures")
    over: dict[str, Values] = key(
        dict,
        "",
        "keys of a config with their values, in the key's unit; the last key changes fastest",
        bounds="FROM:TO:N, FROM:TO:N:log or a list, for each key",
    )
    zip: bool = key(False, "", "the n-th values of all keys make the n-th point, instead of the full grid")
    sample: str = key(
        "",
        "",
        "how to draw points from the intervals, and how many, instead of using a grid",
        bounds="latin-hypercube:N, sobol:N, random:N, or empty",
        default_in_words="empty",
    )
    seed: int = key(1, "1", "seed of the sampled points", ge=0, le=2**32 - 1)
