import pytest

from mapping.similarity2 import Similarity2
from merge.consistency import one_frame
from merge.result import PairResult

WORLD_FROM = {
    "a": Similarity2(1.0, 2.0, 0.3, 1.1),
    "b": Similarity2(-4.0, 0.0, 2.0, 0.7),
    "c": Similarity2(9.0, 5.0, -1.0, 1.6),
    "d": Similarity2(3.0, -5.0, 3.0, 1.0),
}


def pair(target, source, confidence=0.9, transform=None):
    truth = WORLD_FROM[target].inverse() @ WORLD_FROM[source]
    accepted = confidence >= 0.5
    reason = None if accepted else "too little overlap"
    return PairResult(target, source, accepted, confidence, reason, transform or truth, None, "m", None)


def check(frames):
    for name, found in frames.reference_from_map.items():
        truth = WORLD_FROM[frames.reference].inverse() @ WORLD_FROM[name]
        assert found.matrix().ravel() == pytest.approx(truth.matrix().ravel(), abs=1e-12)


def test_a_chain_in_any_order_comes_into_the_frame_of_the_map_that_knows_most():
    known = {"a": 10, "b": 20, "c": 90, "d": 30}
    for pairs in (
        [pair("a", "b"), pair("b", "c"), pair("a", "d")],
        [pair("a", "d"), pair("b", "c", 0.6), pair("a", "b")],
    ):
        frames = one_frame(known, pairs)
        assert frames.reference == "c"
        assert set(frames.reference_from_map) == set(known)
        assert frames.left_out == {}
        assert frames.reference_from_map["c"] == Similarity2.identity()
        check(frames)


def test_the_surest_path_is_taken():
    wrong = pair("a", "c", 0.55, Similarity2(100.0, 0.0))
    frames = one_frame({"a": 3, "b": 2, "c": 1}, [wrong, pair("a", "b", 0.9), pair("b", "c", 0.8)])
    assert set(frames.reference_from_map) == {"a", "b", "c"}
    check(frames)


def test_a_refused_pair_is_not_used_and_its_reason_is_told():
    frames = one_frame({"a": 3, "b": 2, "c": 1}, [pair("a", "b"), pair("a", "c", 0.2), pair("b", "c", 0.3)])
    assert frames.left_out == {"c": "with b: too little overlap"}


def test_the_larger_group_wins_over_the_larger_map():
    frames = one_frame({"a": 99, "b": 2, "c": 3}, [pair("a", "b", 0.1), pair("a", "c", 0.2), pair("b", "c", 0.8)])
    assert frames.reference == "c"
    assert set(frames.left_out) == {"a"}


def test_one_map_alone_is_its_own_frame():
    frames = one_frame({"a": 5}, [])
    assert (frames.reference, dict(frames.left_out)) == ("a", {})
