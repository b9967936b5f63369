"""Confidence of chains of pairs."""

from itertools import permutations

from hypothesis import given
from hypothesis import strategies as st

from merge.multimap.graph import chain_confidences


def by_every_path(members, links, start, end):
    """Try every path."""
    between = [member for member in members if member not in (start, end)]
    best = 0.0
    for number in range(len(between) + 1):
        for path in permutations(between, number):
            stops = (start, *path, end)
            steps = [tuple(sorted(stops[k : k + 2])) for k in range(len(stops) - 1)]
            best = max(best, min(links.get(step, 0.0) for step in steps))
    return best


pairs_of_five = st.sampled_from([(a, b) for a in (1, 2, 4, 7, 9) for b in (1, 2, 4, 7, 9) if a < b])


@given(st.dictionaries(pairs_of_five, st.floats(0.01, 1.0)))
def test_a_chain_is_as_sure_as_its_weakest_link(links):
    members = (1, 2, 4, 7, 9)
    found = chain_confidences(members, links)
    assert found == {(a, b): by_every_path(members, links, a, b) for a in members for b in members if a < b}


def test_two_maps_are_joined_by_the_surer_of_two_chains():
    links = {(0, 1): 0.9, (1, 3): 0.65, (0, 2): 0.8, (2, 3): 0.7}
    assert chain_confidences((0, 1, 2, 3), links)[0, 3] == 0.7
