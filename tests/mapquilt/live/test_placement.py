"""The state machine of a placement: laws under any sequence of events, and the table of the documentation."""

from __future__ import annotations

import math
import re
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.stateful import RuleBasedStateMachine, invariant, precondition, rule

from mapping.geometry.similarity2 import Similarity2
from mapquilt.live.placement import (
    Missing,
    Placement,
    Sighting,
    State,
    advance,
    anchor,
    blended,
    displacement,
    restarted,
)
from mapquilt.live.settings import PlacementSettings

SETTINGS = PlacementSettings()
PAGE = Path(__file__).parents[3] / "docs" / "live.md"
MIDDLE = np.array([4.0, -3.0])

small = st.floats(-0.3, 0.3)
poses = st.builds(Similarity2, st.floats(-20, 20), st.floats(-20, 20), st.floats(-3, 3))
sure = st.floats(SETTINGS.join_confidence, 1.0)


def sighting(pose: Similarity2, confidence: float = 0.96) -> Sighting:
    return Sighting(pose, 0.2, math.radians(1.0), confidence)


def after(placement: Placement, *events: Sighting | Missing) -> Placement:
    for event in events:
        placement = advance(placement, event, MIDDLE, SETTINGS)
    return placement


def join(seen: Sighting) -> Placement:
    return after(Placement(), *[seen] * SETTINGS.confirmations)


class NeverJumps(RuleBasedStateMachine):
    """Any sequence of answers, refusals and restarts."""

    def __init__(self) -> None:
        super().__init__()
        self.now, self.before = Placement(), Placement()

    def step(self, event: Sighting | Missing) -> None:
        self.before, self.now = self.now, advance(self.now, event, MIDDLE, SETTINGS)

    @rule(pose=poses, confidence=st.floats(0.0, 1.0))
    def another_place(self, pose: Similarity2, confidence: float) -> None:
        self.step(sighting(pose, confidence))

    @precondition(lambda self: self.now.held is not None)
    @rule(x=small, y=small, turn=st.floats(-0.02, 0.02), confidence=st.floats(0.0, 1.0))
    def near_the_held(self, x: float, y: float, turn: float, confidence: float) -> None:
        self.step(sighting(self.now.held.merged_from_map.plus([x, y, turn, 0.0]), confidence))

    @rule(contradicted=st.booleans())
    def no_answer(self, contradicted: bool) -> None:
        self.step(Missing("with robot_1: too little overlap", contradicted))

    @rule()
    def restart(self) -> None:
        self.before, self.now = Placement(), restarted("restarted: its frame is new")

    @invariant()
    def a_published_pose_moves_by_a_step_at_most(self) -> None:
        if self.before.published is not None and self.now.published is not None:
            shift, turn = displacement(self.before.published, self.now.published, MIDDLE)
            assert shift <= SETTINGS.max_step + 1e-9
            assert turn <= SETTINGS.max_turn + 1e-9

    @invariant()
    def only_a_confirmed_and_sure_pose_joins(self) -> None:
        if self.now.is_joined and not self.before.is_joined:
            assert self.before.state is State.CANDIDATE
            assert self.now.held.confidence >= SETTINGS.join_confidence

    @invariant()
    def a_join_is_taken_back_only_from_doubt_and_with_a_reason(self) -> None:
        if self.before.is_joined and not self.now.is_joined:
            assert self.before.state is State.SUSPECT
            assert self.now.reason.startswith("taken back: ")
            assert self.now.published is None

    @invariant()
    def every_transition_is_in_the_table(self) -> None:
        assert (self.before.state.value, self.now.state.value) in documented_transitions()


def documented_transitions() -> set[tuple[str, str]]:
    rows = re.findall(r"^\| (\w+) \| [^|]+ \| (\w+) \|", PAGE.read_text(), re.MULTILINE)
    return {(old, new) for old, new in rows if old in {state.value for state in State}}


TestNeverJumps = NeverJumps.TestCase


def test_the_table_names_each_threshold_with_its_value():
    text = PAGE.read_text()
    rows = dict(re.findall(r"^\| `(\w+)` \| ([\d.]+)", text, re.MULTILINE))
    for name, value in vars(SETTINGS).items():
        shown = math.degrees(value) if name == "max_turn" else value
        assert float(rows[name]) == pytest.approx(shown), name


@given(poses, sure)
def test_a_pose_that_is_confirmed_joins_where_it_is(pose, confidence):
    seen = sighting(pose, confidence)
    assert after(Placement(), *[seen] * (SETTINGS.confirmations - 1)).state is State.CANDIDATE
    joined = join(seen)
    assert joined.state is State.JOINED
    assert joined.published == pose


def test_an_unsure_pose_never_joins():
    unsure = sighting(Similarity2(), SETTINGS.join_confidence - 0.01)
    assert after(Placement(), *[unsure] * 10).state is State.ALONE


@given(poses, st.floats(-0.5, 0.5), st.floats(-0.5, 0.5), st.floats(-0.03, 0.03))
def test_a_constant_answer_is_reached(pose, x, y, turn):
    held = pose.plus([x, y, turn, 0.0])
    for _ in range(60):
        held = blended(held, pose, MIDDLE, SETTINGS)
    shift, angle = displacement(held, pose, MIDDLE)
    assert shift < 1e-3
    assert angle < 1e-4


def test_a_contradicted_join_is_taken_back_and_an_unsupported_one_later():
    seen = sighting(Similarity2(1.0, 2.0, 0.5))
    joined = join(seen)
    against = Missing("with robot_1: walls contradict free space", contradicted=True)
    assert after(joined, *[against] * (SETTINGS.patience - 1)).published == seen.merged_from_map
    taken_back = after(joined, *[against] * SETTINGS.patience)
    assert taken_back.reason == "taken back: no pair supports it any more: with robot_1: walls contradict free space"
    silent = Missing("with robot_1: too little overlap")
    assert after(joined, *[silent] * (SETTINGS.long_patience - 1)).is_joined
    assert not after(joined, *[silent] * SETTINGS.long_patience).is_joined
    assert after(joined, against, seen, against, seen, against, seen).state is State.JOINED


def test_another_place_replaces_the_held_one_only_if_it_is_surer():
    here, there = Similarity2(), Similarity2(10.0, 0.0, 0.0)
    joined = join(sighting(here, 0.98))
    assert after(joined, *[sighting(there, 0.97)] * 20) == joined
    replaced = after(joined, *[sighting(there, 0.99)] * SETTINGS.patience)
    assert replaced.published is None
    assert "10.0 m" in replaced.reason
    assert after(replaced, *[sighting(there, 0.99)] * SETTINGS.confirmations).published == there


def test_the_map_that_fixes_the_frame_is_exact():
    assert anchor(Similarity2()).holds_frame
    assert not join(sighting(Similarity2())).holds_frame
