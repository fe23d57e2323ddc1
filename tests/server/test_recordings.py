"""Walks survive being stored, whatever is in them."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from radioslam.errors import ServiceError
from radioslam.server.messages import Batch
from radioslam.server.recordings import assembled, body_of, packed, sealed, unpacked
from radioslam.server.replay import batches
from radioslam.simulator import simulate
from tests.server.test_walks import same

WALKS = [
    simulate("office", seed=3, walks=1)[0],
    simulate("office", seed=3, walks=1, inertial=True)[0],
]
SAMPLES = {"time_s": [0.0, 1.0], "values": [[0.0, 0.0, 9.8], [0.1, 0.2, 9.7]]}


def plain(address: str) -> str:
    return address


@pytest.mark.parametrize("walk", WALKS, ids=["poses", "inertial"])
def test_a_whole_walk_comes_back(walk):
    assert same(assembled("a", [unpacked(sealed(body_of(walk, plain))[0])]), walk)


@settings(max_examples=20, deadline=None)
@given(batch_s=st.floats(3.0, 200.0), which=st.integers(0, 1))
def test_however_it_is_cut(batch_s, which):
    bodies = [unpacked(packed(Batch.model_validate(one), plain)[0]) for _, one in batches(WALKS[which], batch_s)]
    assert same(assembled("a", bodies), WALKS[which])


def test_the_same_batch_has_the_same_digest():
    batch = Batch.model_validate(next(one for _, one in batches(WALKS[0], 20.0)))
    assert packed(batch, plain)[1] == packed(batch.model_copy(), plain)[1]
    assert packed(batch, plain)[1] != packed(batch, str.upper)[1]


@pytest.mark.parametrize(
    "inertial",
    [
        {"accelerometer": {**SAMPLES, "time_s": [0.0]}},
        {"gyroscope": {**SAMPLES, "values": [[0.0] * 4, [0.0] * 3]}},
        {"rotation_vector": {"time_s": [0.0], "values": [[0.0, 0.0, 0.0, 2.0]]}},
    ],
)
def test_samples_of_the_wrong_shape(inertial):
    with pytest.raises(ServiceError, match="expected"):
        packed(Batch.model_validate({"sequence": 0, "inertial": inertial}), plain)


def test_nothing_is_a_walk_without_anything():
    walk = assembled("a", [{}])
    assert len(walk.wifi) == 0
    assert walk.motion is None
    assert np.isfinite(walk.start_s)


def test_a_walk_that_has_only_begun_is_empty_and_no_error():
    walk = assembled("begun", [])
    assert len(walk.wifi) == 0
    assert walk.odometry is None
    assert walk.inertial is None
