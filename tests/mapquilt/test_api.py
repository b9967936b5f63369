"""The Python interface does what the command line does."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import mapquilt as mq
from tests.conftest import command, hashes

SHORT = {"robots": 2, "seed": 3, "duration": 12.0}


@pytest.fixture(scope="module")
def sample() -> mq.Sample:
    return mq.simulate("office", **SHORT)


def test_every_exported_name_loads() -> None:
    assert dir(mq) == sorted(mq.__all__)
    for name in mq.__all__:
        assert getattr(mq, name) is not None
    with pytest.raises(AttributeError, match="no attribute 'merg'"):
        mq.merg  # noqa: B018


def test_simulating_in_memory_gives_what_the_run_holds(sample: mq.Sample, merged_run: Path, tmp_path: Path) -> None:
    written = mq.simulate("office", **SHORT, out=tmp_path / "run")
    for name, ours, theirs in zip(sample.maps.names, sample.maps.grids, written.maps.grids, strict=True):
        np.testing.assert_array_equal(ours.log_odds, theirs.log_odds)
        on_disk = (merged_run / name / "map.pgm").read_bytes()
        assert (tmp_path / "run" / name / "map.pgm").read_bytes() == on_disk


def test_merging_files_grids_and_a_run_agree(merged_run: Path, tmp_path: Path) -> None:
    files = [merged_run / f"robot_{index}" / "map.yaml" for index in range(2)]
    maps = [mq.load_map(file).grid for file in files]
    free = {"scale": mq.ScaleRange.free()}
    by_grids = mq.merge(maps, **free).pairs[0]
    by_files = mq.merge([str(files[0]), files[1]], **free, out=tmp_path / "merged").pairs[0]
    by_set = mq.merge(mq.MapSet(("a", "b"), tuple(maps), ("m", "m")), mq.MergeSettings(**free)).pairs[0]
    assert by_grids.target_from_source == by_files.target_from_source == by_set.target_from_source
    assert command("merge", *files, "--scale", "free", "--out", tmp_path / "by_command") in (0, 1)
    assert hashes(tmp_path / "by_command") == hashes(tmp_path / "merged")


def test_maps_that_cannot_be_merged_are_named(tmp_path: Path, sample: mq.Sample) -> None:
    with pytest.raises(ValueError, match=r"maps\[1\] is a int, must be"):
        mq.merge([sample.maps.grids[0], 3])  # type: ignore[list-item]
    with pytest.raises(ValueError, match=r"maps\[1\] is a OccupancyGrid, must be a file name like the others"):
        mq.merge(["a.yaml", sample.maps.grids[0]])
    with pytest.raises(ValueError, match="out is x, must be None for maps in memory"):
        mq.merge(sample.maps, out="x")
    with pytest.raises(ValueError, match="no such run folder"):
        mq.merge(tmp_path / "nothing")
    with pytest.raises(ValueError, match="method is 'best'"):
        mq.merge(sample.maps, method="best")
