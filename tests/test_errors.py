import pickle
from pathlib import Path

import pytest

from radioslam.errors import ConfigError, DoorError, GraphError, LogError, MappingError, RadioSlamError, ResultError


@pytest.mark.parametrize("kind", [LogError, ConfigError, MappingError, GraphError, ResultError, DoorError])
def test_every_error_is_of_one_tree(kind):
    assert issubclass(kind, RadioSlamError)


def test_a_bad_graph_is_a_failed_mapping():
    assert issubclass(GraphError, MappingError)


def test_a_log_error_says_where_what_was_expected_what_came_and_what_to_do():
    error = LogError("walks/a.txt", "9 fields", "7", "record again", line=12)
    assert str(error) == "walks/a.txt:12: expected 9 fields, found 7; record again"


def test_a_log_error_of_a_whole_file_has_no_line():
    error = LogError(Path("a.txt"), "text", "bytes")
    assert str(error) == "a.txt: expected text, found bytes"
    assert error.line is None


def test_a_log_error_keeps_its_path_and_line():
    error = LogError("walks/a.txt", "9 fields", "7", line=12)
    assert error.path == Path("walks/a.txt")
    assert error.line == 12


def test_a_log_error_crosses_process_borders_whole():
    error = LogError("a.txt", "9 fields", "7", "record again", line=12)
    twin = pickle.loads(pickle.dumps(error))
    assert type(twin) is LogError
    assert (str(twin), twin.path, twin.line) == (str(error), error.path, error.line)


@pytest.mark.parametrize("kind", [RadioSlamError, ConfigError, MappingError, GraphError, ResultError])
def test_the_other_errors_cross_process_borders_too(kind):
    twin = pickle.loads(pickle.dumps(kind("said once")))
    assert type(twin) is kind
    assert str(twin) == "said once"
