"""Settings of a merge: one tree of checked leaves, which can be sent to worker processes."""

import dataclasses
import pickle
import subprocess
import sys
from dataclasses import dataclass, replace

import pytest

from mapping.geometry.similarity2 import Similarity2
from merge import MergeSettings
from merge.alignment.settings import AlignmentSettings, ElasticSettings, HypothesisSettings
from merge.literature.acceptance import no_answer
from merge.methods import method_names, published_names, register
from merge.pair.pipeline import match
from merge.pair.task import PairTask
from merge.preparation.settings import PreparationSettings
from merge.records.proposal import Proposal
from merge.records.verdict import Reason
from merge.verification.settings import WallOverlapSettings
from tests.merge.test_merger import team

CHOICES = {"scale", "priors"}
"""Fields of a merge that hold records of their own."""


def leaves(settings, path="merge"):
    for field in dataclasses.fields(settings):
        value, name = getattr(settings, field.name), f"{path}.{field.name}"
        if dataclasses.is_dataclass(value):
            yield from leaves(value, name)
        elif field.name not in CHOICES:
            yield name, value


def test_every_leaf_is_a_number_a_text_or_a_tuple_of_numbers():
    found = dict(leaves(MergeSettings()))
    assert len(found) > 150
    assert "merge.alignment.careful.first_gate_share" in found
    for name, value in found.items():
        plain = value if isinstance(value, tuple) else (value,)
        assert all(each is None or isinstance(each, bool | int | float | str) for each in plain), name


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: ElasticSettings(min_points=-1), "ElasticSettings: min_points is -1, must be positive"),
        (lambda: ElasticSettings(max_points=1.5), "ElasticSettings: max_points is 1.5, must be a whole number"),
        (lambda: ElasticSettings(gate_shares=()), "ElasticSettings: gate_shares is empty"),
        (lambda: HypothesisSettings(crisp_ratio=1.2), "HypothesisSettings: crisp_ratio is 1.2, must lie between 0"),
        (lambda: PreparationSettings(behind_walls=float("nan")), "PreparationSettings: behind_walls is nan, must be"),
        (lambda: PreparationSettings(border_cells=-2), "PreparationSettings: border_cells is -2, must not be negative"),
        (lambda: WallOverlapSettings(tolerance_shares=(0.01, 0.02)), "tolerance_shares is .* must not rise"),
    ],
)
def test_a_bad_value_is_refused_with_class_field_and_rule(make, message):
    with pytest.raises(ValueError, match=message):
        make()


def answer(settings):
    maps, _ = team(8, 2)
    return match(PairTask.of(maps, 0, 1, maps.scale_range, settings, 0))


@pytest.mark.slow
def test_settings_of_deep_steps_reach_them():
    usual = answer(MergeSettings())
    narrow = WallOverlapSettings(tolerance_shares=(0.0001,), min_tolerance_cells=0.01)
    changed = answer(MergeSettings(alignment=AlignmentSettings(overlap=narrow)))
    assert changed.evidence.score < 0.5 * usual.evidence.score
    bare = answer(MergeSettings(pair=replace(MergeSettings().pair, min_wall_points=10**6)))
    assert bare.reason is Reason.LITTLE_STRUCTURE


@dataclass(frozen=True)
class Guess:
    """A proposer of one transform."""

    def describe(self, prepared):
        return None

    def propose(self, target, source, scale, rng):
        return (Proposal(Similarity2()),)

    def published(self, target, source, scale, rng):
        return no_answer()


@pytest.fixture
def guess(monkeypatch):
    monkeypatch.setattr("merge.methods._registered", {})
    register("guess", (Guess(),), Guess())
    return MergeSettings("guess")


def test_a_registered_method_is_a_method_like_any_other(guess):
    assert "guess" in method_names() and "guess" in published_names()
    assert guess.chosen_proposers == (Guess(),)
    assert answer(guess).evidence is not None
    assert answer(replace(guess, as_published=True)).reason is Reason.NO_PUBLISHED_ANSWER


@pytest.mark.slow
def test_a_worker_process_knows_the_registered_method_of_its_settings(guess):
    code = "import pickle, sys; print(pickle.load(sys.stdin.buffer).method)"
    found = subprocess.run([sys.executable, "-c", code], input=pickle.dumps(guess), capture_output=True, check=True)
    assert found.stdout.split() == [b"guess"]
    assert pickle.loads(pickle.dumps(guess)) == guess


def test_names_of_built_in_methods_and_methods_without_proposers_are_refused():
    with pytest.raises(ValueError, match="method 'quilt' is built in"):
        register("quilt", (Guess(),))
    with pytest.raises(ValueError, match="method 'empty' has no proposer"):
        register("empty", ())
