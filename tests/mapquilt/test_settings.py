"""Every interface reads and changes one settings tree, and a new field appears in all of them."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from pathlib import Path

import pytest

from mapping.geometry.scale_range import ScaleRange
from mapping.settings import MappingSettings
from mapquilt.dataset.plan import plan_dataset
from mapquilt.dataset.spec import load_spec
from mapquilt.json_file import read_record
from mapquilt.leaves import changed_leaves, get_leaf, leaf_name, leaf_names, split_assignment, with_leaf
from mapquilt.settings import COMBINED, ExperimentConfig
from sim.sensors.odometry import OdometryNoise
from tests.conftest import command
from tests.mapquilt.study.conftest import plan

TEXTS = {
    "world.family": "house",
    "mission.lidar": "rplidar_a1",
    "mission.beams": "90",
    "mission.starts": "close",
    "mission.drive": "wheels",
    "mission.policy": "patrol",
    "mission.overlap": "0.2:0.4",
    "mapping.mapper": "particle",
    "mapping.particle.proposal": "gaussian",
    "mapping.poses": "truth",
    "mapping.sensor_model": "hector",
    "perturbation.scale": "0.8:1.25",
    "merge.method": "orb",
    "merge.scale": "free",
    "merge.fusion": "max",
    "merge.reference": "robot_1",
    "merge.proposers.rectangles.median_cells": "7",
}


def changed_text(name: str) -> str:
    """Write a valid value that differs from the default."""
    if name in TEXTS:
        return TEXTS[name]
    value = get_leaf(ExperimentConfig(), name)
    if isinstance(value, bool):
        return "false" if value else "true"
    if isinstance(value, str) and name.endswith(".greys"):
        return "two"
    if isinstance(value, str):  # the features of a method
        return "orb" if value == "sift" else "sift"
    if isinstance(value, tuple):
        return ":".join(repr(1.02 * number) for number in value)
    if isinstance(value, int):
        return str(value + 1)
    return "0.125" if value is None else repr(value * 0.98 if value else 0.125)


DEFAULTS = ExperimentConfig()


@pytest.mark.parametrize("name", list(leaf_names(DEFAULTS)))
def test_each_leaf_is_parsed_and_changes_nothing_else(name: str) -> None:
    start = with_leaf(DEFAULTS, "method", "orb") if name == "merge.as_published" else DEFAULTS
    config = with_leaf(start, name, changed_text(name))
    assert set(changed_leaves(config, start)) == {name}


def test_any_unambiguous_ending_names_a_leaf() -> None:
    assert leaf_name(DEFAULTS, "range_sigma") == leaf_name(DEFAULTS, "lidar.range_sigma") == "sensing.lidar.range_sigma"
    with pytest.raises(ValueError, match=r"scale is ambiguous: merge\.scale, perturbation\.scale"):
        leaf_name(DEFAULTS, "scale", COMBINED)
    with pytest.raises(ValueError, match="nose is no setting; did you mean noise"):
        leaf_name(DEFAULTS, "nose")
    for text in ("noise", "=1", "noise="):
        with pytest.raises(ValueError, match=r"--set .*: (must be NAME=VALUE| is no setting)"):
            split_assignment(DEFAULTS, "--set", text)


def test_combined_settings_set_all_their_leaves() -> None:
    config = with_leaf(ExperimentConfig(), "odometry.level", "3", COMBINED)
    noise = config.sensing.noise_of("default")
    assert noise.odometry == OdometryNoise().scaled(3.0)
    assert noise.lidar == ExperimentConfig().sensing.noise_of("default").lidar
    assert with_leaf(config, "max_rotation", "90", COMBINED).perturbation.max_yaw == pytest.approx(math.pi / 2)
    assert with_leaf(config, "perturbation.scale", "honest", COMBINED).perturbation.honest
    assert set(COMBINED).isdisjoint(leaf_names(DEFAULTS))


def test_a_component_is_independent_of_the_noise_level() -> None:
    config = with_leaf(with_leaf(ExperimentConfig(), "noise", "3"), "lidar.range_sigma", "0.05")
    assert config.sensing.noise_of("default").lidar.range_sigma == 0.05
    assert config.sensing.noise_of("default").odometry.alpha1 == pytest.approx(3 * OdometryNoise().alpha1)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("noise=much", "noise=much: 'much' is no number"),
        ("robots=2.5", "robots=2.5: '2.5' is no whole number"),
        ("as_published=yes", "'yes' must be true or false"),
        ("resolution=0", "resolution is 0.0, must lie between"),
        ("merge.scale=0:1", "must be LO:HI with"),
    ],
)
def test_invalid_values_are_named(text: str, words: str) -> None:
    with pytest.raises(ValueError, match=words):
        with_leaf(ExperimentConfig(), *split_assignment(DEFAULTS, "--set", text))


def test_optional_settings_accept_none() -> None:
    config = with_leaf(ExperimentConfig(), "beams", "90")
    assert with_leaf(config, "beams", "none") == ExperimentConfig()
    assert with_leaf(ExperimentConfig(), "merge.scale", "0.5:1").merge.scale == ScaleRange(0.5, 1.0)


@dataclass(frozen=True)
class Extended(MappingSettings):
    """Mapping with one more setting."""

    added_cells: float = 2.0


def test_a_field_added_to_a_settings_class_is_a_leaf_at_once() -> None:
    """The names come from the classes alone: nothing else lists them."""
    extended = replace(DEFAULTS, mapping=Extended())
    assert set(leaf_names(extended)) - set(leaf_names(DEFAULTS)) == {"mapping.added_cells"}
    assert split_assignment(extended, "--vary", "added_cells=3") == ("mapping.added_cells", "3")
    changed = with_leaf(extended, "added_cells", "3")
    assert changed.mapping == Extended(added_cells=3.0)
    assert changed_leaves(changed, extended) == {"mapping.added_cells": 3.0}


def test_the_interfaces_change_the_same_leaf(merged_run: Path, tmp_path: Path) -> None:
    """One leaf of each branch, set by the command line, a study, a data set and Python."""
    by_study = plan("clear_range=1,2", fixed=("robots=2", "merge.acceptance.min_confidence=0.9")).setups[0][1]
    by_python = replace(ExperimentConfig().mapping, clear_range=1.0)
    assert by_study.mapping == by_python
    assert by_study.merge.acceptance.min_confidence == 0.9
    file = tmp_path / "spec.yaml"
    file.write_text(
        "name: tiny\nmissions: [{world: office, count: 1}]\n"
        "samples: {per_mission: 2, clear_range: 1, set: {perturbation.max_offset: [1, 2]}}\n"
    )
    samples = plan_dataset(load_spec(str(file))).missions[0].samples
    assert {sample.settings.mapping.clear_range for sample in samples} == {by_python.clear_range}
    assert sorted(sample.settings.perturbation.max_offset for sample in samples) == [1.0, 2.0]
    assert command("sense", merged_run, "--set", "clear_range=1", "--out", tmp_path / "run") == 0
    assert read_record(tmp_path / "run/run.json", "run")["clear_range_m"] == 1.0
    maps = [merged_run / f"robot_{index}/map.yaml" for index in range(2)]
    out = tmp_path / "merged"
    assert command("merge", *maps, "--set", "multimap.edges.max_log_odds=4", "--out", out) in (0, 1)
    assert read_record(out / "merge.json", "merge")["settings"] == {"merge.multimap.edges.max_log_odds": 4.0}
