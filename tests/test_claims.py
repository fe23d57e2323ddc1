import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from radioslam.claims import first_in_claims, take_greedily


@st.composite
def claimed(draw):
    """Priorities with ties, and two or three claims each."""
    n, k = draw(st.integers(0, 25)), draw(st.integers(1, 3))
    priority = draw(st.lists(st.integers(0, 6), min_size=n, max_size=n))
    claims = draw(st.lists(st.lists(st.integers(0, 12), min_size=k, max_size=k), min_size=n, max_size=n))
    return np.array(priority, dtype=float), np.array(claims, dtype=np.int64).reshape(n, k)


def greedily(priority, claims):
    return take_greedily(priority, claims.__getitem__, int(claims.max(initial=-1)) + 1)


@given(claimed())
def test_taking_greedily_equals_the_loop_over_the_sorted_items(items):
    priority, claims = items
    used, expected = set(), np.zeros(len(priority), bool)
    for p in sorted(range(len(priority)), key=lambda p: (-priority[p], p)):
        if not used & set(claims[p].tolist()):
            used |= set(claims[p].tolist())
            expected[p] = True
    np.testing.assert_array_equal(greedily(priority, claims), expected)


@given(claimed())
def test_first_in_claims_beats_all_who_share_a_claim(items):
    priority, claims = items
    rank = [(-priority[p], p) for p in range(len(claims))]
    expected = [
        all(rank[p] <= rank[q] for q in range(len(rank)) if set(claims[p].tolist()) & set(claims[q].tolist()))
        for p in range(len(rank))
    ]
    assert first_in_claims(priority, claims).tolist() == expected


def test_taking_greedily_in_chunks_changes_nothing(monkeypatch):
    rng = np.random.default_rng(4)
    priority, claims = rng.integers(0, 50, 3000).astype(float), rng.integers(0, 900, (3000, 2))
    whole = greedily(priority, claims)
    monkeypatch.setattr("radioslam.claims.CHUNK", 64)
    np.testing.assert_array_equal(greedily(priority, claims), whole)
