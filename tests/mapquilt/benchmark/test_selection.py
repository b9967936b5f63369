from collections import Counter

import numpy as np
import pytest

from mapquilt.benchmark.selection import even_sample
from tests.mapquilt.benchmark.made import pair

PAIRS = [pair(f"{k}", negative=k % 3 == 0, world=("office", "cave")[k % 2]) for k in range(60)]


@pytest.mark.parametrize("number", [12, 6])
def test_every_stratum_gets_its_share(number):
    chosen = even_sample(PAIRS, number, np.random.default_rng(0))
    shares = Counter((one.truth is None, one.world) for one in chosen)
    assert len({one.name for one in chosen}) == number
    assert shares == {
        (True, "office"): number / 6,
        (True, "cave"): number / 6,
        (False, "office"): number / 3,
        (False, "cave"): number / 3,
    }
    assert [int(one.name) for one in chosen] == sorted(int(one.name) for one in chosen)


def test_the_choice_is_the_seeds():
    names = [[one.name for one in even_sample(PAIRS, 12, np.random.default_rng(seed))] for seed in (0, 0, 1)]
    assert names[0] == names[1] != names[2]


def test_more_than_there_are_takes_all_and_none_is_refused():
    assert even_sample(PAIRS, 99, np.random.default_rng(0)) == PAIRS
    with pytest.raises(ValueError, match="--limit 0"):
        even_sample(PAIRS, 0, np.random.default_rng(0))
