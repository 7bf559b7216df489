"""Check that every failure on which a user can act has a message, advice and an exit code."""

import pickle

import pytest

from walkerlab import errors


@pytest.mark.parametrize(
    ("kind", "exit_code"),
    [
        (errors.ConfigError, 3),
        (errors.NoAnswer, 4),
        (errors.StorageError, 4),
        (errors.StaleError, 5),
        (errors.LockedError, 6),
        (errors.StoppedError, 130),
    ],
)
def test_each_failure_has_the_exit_code_of_the_command_line(kind: type[errors.WalkerlabError], exit_code: int) -> None:
    assert issubclass(kind, errors.WalkerlabError)
    assert kind.exit_code == exit_code


def test_failure_message_states_what_happened_and_what_to_do() -> None:
    error = errors.NoAnswer("no gait at 10 deg", "try a slope below 5 deg", partial={"states": 3})
    assert (str(error), error.advice, error.partial) == ("no gait at 10 deg", "try a slope below 5 deg", {"states": 3})


def test_failure_survives_pickling_from_a_worker_process() -> None:
    sent = errors.NoAnswer("no gait", "less slope")
    got = pickle.loads(pickle.dumps(sent))
    assert (type(got), got.message, got.advice) == (errors.NoAnswer, "no gait", "less slope")


def test_failure_messages_contain_no_control_characters() -> None:
    name = "hip\x1b[2J\x1b]0;gone\x07\r\u202e\x9b1m, Hüfte\n\tfoot"
    error = errors.ConfigError(f"no column {name}", f"Name it: {name}")
    told = "hip\\x1b[2J\\x1b]0;gone\\x07\\r\\u202e\\x9b1m, Hüfte\n\tfoot"
    assert str(error) == error.message == error.as_json()["message"] == f"no column {told}"
    assert error.advice == f"Name it: {told}"
