import pytest

from radioslam.privacy import may_be_mapped


@pytest.mark.parametrize("ssid", [None, "Guest", "nomap", "my_nomap_net", "Cafe, Rose", "optout"])
def test_networks_whose_owners_said_nothing_may_be_kept(ssid):
    assert may_be_mapped(ssid)


@pytest.mark.parametrize(
    "ssid",
    ["home_nomap", "HOME_NOMAP", " home_nomap ", "my_optout_net", "a_OptOut", "", "  ", "\0\0", "\\x00\\x00", '""'],
)
def test_networks_that_opted_out_and_hidden_ones_are_not(ssid):
    assert not may_be_mapped(ssid)
