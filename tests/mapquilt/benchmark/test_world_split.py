"""Split of pairs by world: none is on both sides."""

from collections import Counter
from dataclasses import replace

import pytest
from hypothesis import given
from hypothesis import strategies as st

from mapquilt.benchmark.world_split import shown_worlds, split_by_world, with_worlds
from tests.mapquilt.evaluation.examples import benchmark_pair, info

FAMILIES = ("office", "cave", "maze", "house", "outdoor")
WORLDS = st.lists(st.sets(st.sampled_from(FAMILIES), min_size=1, max_size=2).map(sorted).map("+".join), min_size=1)


@given(WORLDS.filter(lambda worlds: len({name for one in worlds for name in one.split("+")}) > 1))
def test_no_world_is_on_both_sides_and_no_pair_is_lost(worlds):
    pairs = [benchmark_pair(str(number), world=world) for number, world in enumerate(worlds)]
    split = split_by_world(pairs)
    sides = [{name for pair in side for name in pair.info.world.split("+")} for side in (split.fit, split.check)]
    assert not sides[0] & sides[1]
    assert sides[1] <= set(split.check_worlds)
    parts = [*split.fit, *split.check, *split.mixed]
    assert sorted(pair.info.name for pair in parts) == sorted(pair.info.name for pair in pairs)
    for pair in split.mixed:
        assert len(set(pair.info.world.split("+")) & set(split.check_worlds)) == 1


def test_about_a_third_is_checked_on():
    split = split_by_world([benchmark_pair(f"{k}", world=FAMILIES[k % 5]) for k in range(100)])
    assert Counter(map(len, (split.fit, split.check))) == Counter((60, 40))


def test_the_families_of_two_missions_are_looked_up():
    pairs = [info("a", mission="1", world="office"), info("b", mission="2", world="cave"), info("c", mission="1+2")]
    assert shown_worlds(pairs)[2] == {"office", "cave"}
    named = with_worlds([replace(benchmark_pair(), info=one) for one in pairs])
    assert shown_worlds([named[2].info]) == [{"office", "cave"}]


def test_missions_of_no_family_are_worlds_and_lists_of_no_mission_too():
    pairs = [info("a", mission="1"), info("b", mission="2+1"), info("c"), info("d", suite="other")]
    assert shown_worlds(pairs) == [{"made/1"}, {"made/2", "made/1"}, {"made"}, {"other"}]


def test_pairs_of_one_world_cannot_be_split():
    with pytest.raises(ValueError, match="'office', the check needs another"):
        split_by_world([benchmark_pair("a", world="office"), benchmark_pair("b", world="office")])
