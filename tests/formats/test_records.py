import numpy as np
import pytest

from radioslam.errors import LogError
from radioslam.formats.lines import Lines
from radioslam.formats.readings import mac_address, wifi_scans
from radioslam.formats.records import from_csv, from_objects, json_documents

TEXT = b'Time , Name,x\n1,"a, ""b""",2.5\n\n2,"two\nlines",\r\n'


def test_csv_cells_may_be_quoted_and_know_their_lines(tmp_path):
    records = from_csv(tmp_path, TEXT, first_line=3)
    assert list(records.cells) == ["time", "name", "x"]
    assert records.text("name") == ['a, "b"', "two\nlines"]
    assert records.lines.number == [4, 7]
    np.testing.assert_array_equal(records.numbers("x", blank=True), [2.5, np.nan])
    assert np.isnan(records.numbers("other", blank=True)).all()
    assert records.take(np.array([False, True])).text("time") == ["2"]


@pytest.mark.parametrize("cell", [b"", b"nan", b"inf", b"1_0", b"x", b"1e999"])
def test_what_is_no_number_is_named_with_its_line(tmp_path, cell):
    with pytest.raises(LogError, match="a finite number as x") as error:
        from_csv(tmp_path, b"t,x\n1,2\n2," + cell + b"\n").numbers("x")
    assert error.value.line == 3


def test_objects_are_records_whatever_their_fields(tmp_path):
    records = from_objects(tmp_path, [{"A": 1}, {"a": None, "b": "x"}, {"a": 1698501144401773000}], [1, 1, 2])
    assert records.text("b") == ["", "x", ""]
    np.testing.assert_allclose(records.numbers("a", blank=True), [1, np.nan, 1.698501144401773e18])


def test_json_values_follow_each_other_with_their_lines(tmp_path):
    assert [*json_documents(tmp_path, b'[1,\n2] {"a":\n3}\n\n 4')] == [([1, 2], 1), ({"a": 3}, 2), (4, 5)]


@pytest.mark.parametrize(
    ("text", "line"), [(b"[1]\n[2\n3]", 3), (b"[1]\n\xff", 2), (b"[" * 100_000, 1), (b"\n" + b"1" * 5000, 2)]
)
def test_what_is_no_json_is_named_with_its_line(tmp_path, text, line):
    with pytest.raises(LogError) as error:
        [*json_documents(tmp_path, text)]
    assert error.value.line == line


@pytest.mark.parametrize("text", ["AA:BB:CC:00:11:22", "aa-bb-cc-00-11-22", "aabb.cc00.1122", " aabbcc001122 "])
def test_addresses_have_one_form(text):
    assert mac_address(text) == "aa:bb:cc:00:11:22"


@pytest.mark.parametrize("text", ["", "aa:bb:cc:00:11", "aa:bb:cc:00:11:2g", "aa::bb:cc:00:11:22", "Guest"])
def test_other_texts_are_no_address(text):
    assert mac_address(text) is None


def test_private_networks_are_left_out_with_a_note(tmp_path):
    lines, notes = Lines(tmp_path, [b""] * 3, [1, 2, 3]), []
    addresses = ["aabbcc001122", "aabbcc001133", "aabbcc001144"]
    scans = wifi_scans(lines, np.zeros(3), addresses, np.full(3, -50.0), notes, ssid=["x", "x_nomap", ""])
    assert scans.transmitters == ("aa:bb:cc:00:11:22",)
    assert notes == ["2 readings of hidden networks, _nomap or _optout left out"]
