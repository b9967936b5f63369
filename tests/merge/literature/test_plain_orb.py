import numpy as np
import pytest

from mapping.geometry.scale_range import ScaleRange
from merge.literature.plain_orb import PlainOrb
from tests.merge.literature.crisp import blank, crisp_pair, off_share


@pytest.mark.parametrize("scale", [1.0, 1.3])
def test_a_crisp_pair_is_found_and_accepted(scale):
    target, source, truth = crisp_pair(scale)
    method = PlainOrb()
    maps = method.describe(target), method.describe(source)
    answer = method.published(*maps, ScaleRange.free(), np.random.default_rng(0))
    assert answer.verdict.accepted
    assert answer.verdict.confidence > 0.5
    assert off_share(answer.target_from_source, truth, source) < 0.015
    (proposal,) = method.propose(*maps, ScaleRange(scale, scale), np.random.default_rng(0))
    assert off_share(proposal.target_from_source, truth, source) < 0.015
    assert proposal.target_from_source.scale == scale


def test_its_own_rule_requires_ten_inliers():
    target, source, _ = crisp_pair()
    eager, strict = PlainOrb(min_inliers=1), PlainOrb(min_inliers=100_000)
    verdicts = [
        m.published(m.describe(target), m.describe(source), ScaleRange.free(), np.random.default_rng(0)).verdict
        for m in (eager, strict)
    ]
    assert [v.accepted for v in verdicts] == [True, False]
    assert "inliers is" in str(verdicts[1].refusal)
    assert "100000" in str(verdicts[1].refusal).replace("1e+05", "100000")


def test_nothing_is_found_on_a_blank_or_tiny_map():
    target, _, _ = crisp_pair()
    method = PlainOrb()
    for other in (blank(), blank(5, 7)):
        maps = method.describe(target), method.describe(other)
        assert method.propose(*maps, ScaleRange.free(), np.random.default_rng(0)) == ()
        answer = method.published(*maps, ScaleRange.free(), np.random.default_rng(0))
        assert answer.target_from_source is None
        assert not answer.verdict.accepted


def test_a_bad_setting_is_named():
    with pytest.raises(ValueError, match="features is 0"):
        PlainOrb(features=0)
