"""Check that wrong requests are rejected before anything runs."""

import re

import pytest

from walkerlab.config.files import builtin_config
from walkerlab.errors import ConfigError
from walkerlab.pipeline.plan.resolve import resolve


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ("locks: true", "locks: false", "no locking knee"),
        ("child: thigh 1", "child: shank 1", "are not hinged together"),
    ],
)
def test_parts_that_form_no_walker_are_rejected_with_position(tmp_path, old, new, said):
    whole = builtin_config("parts").path.read_text()
    assert old in whole
    file = tmp_path / "mine.yaml"
    file.write_text(whole.replace(old, new, 1))
    line = 1 + whole[: whole.index("type: parts")].count("\n")
    with pytest.raises(ConfigError, match=rf"^{re.escape(str(file))}:{line}:\d+: walker: .*{said}"):
        resolve(str(file))
