"""Count the stones one by one. If a test says so, end the process after some of them."""

import os

from walkerlab.pipeline.store.content import Content


def run(config, inputs, progress, checkpoint):
    stones = [f"stone {number}" for number in range(4)]
    counted_now = 0
    for number, stone in enumerate(stones):
        if stone not in checkpoint.kept:
            if counted_now == int(os.environ.get("TOY_STONES", 4)):
                raise KeyboardInterrupt
            checkpoint.keep(stone, [0.1 * number])
            counted_now += 1
    return Content({}, {"stones": [checkpoint.kept[stone][0] for stone in stones], "seed": config.seed})
