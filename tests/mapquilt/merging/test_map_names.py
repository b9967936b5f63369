"""Names of maps: the shortest end of a path that tells it from the others."""

from __future__ import annotations

from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from mapquilt.merging.map_names import known_name, map_names

PARTS = st.lists(st.sampled_from(["a", "b", "map"]), min_size=1, max_size=4)


@pytest.mark.parametrize(
    ("paths", "names"),
    [
        (["/x/a/map.yaml", "/x/b/map.yaml"], ("a/map", "b/map")),
        (["/x/a/map.yaml", "/y/a/map.yaml", "/b/map.yaml"], ("x/a/map", "y/a/map", "b/map")),
        (["/x/floor.yaml", "/x/lab.pgm"], ("floor", "lab")),
        (["/x/floor.yaml", "/x/floor.png"], ("floor.yaml", "floor.png")),
        (["/map.yaml", "/a/map.yaml"], ("map.yaml", "a/map")),
        (["/x/../y/a/map.yaml", "/y/b/map.yaml"], ("a/map", "b/map")),
    ],
)
def test_names_by_hand(paths: list[str], names: tuple[str, ...]) -> None:
    assert map_names([Path(path) for path in paths]) == names


def test_names_of_relative_paths_do_not_depend_on_the_folder_above(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "a").mkdir()
    monkeypatch.chdir(tmp_path / "a")
    assert map_names([Path("map.yaml"), Path("../b/map.yaml")]) == ("a/map", "b/map")


@given(st.lists(st.tuples(PARTS, st.sampled_from([".yaml", ".png"])), min_size=1, max_size=6, unique_by=str))
def test_names_differ_are_ends_of_their_paths_and_begin_with_no_slash(files: list[tuple[list[str], str]]) -> None:
    paths = [Path("/", *parts).with_suffix(ending) for parts, ending in files]
    names = map_names(paths)
    assert len(set(names)) == len(paths)
    for path, name in zip(paths, names, strict=True):
        assert str(path).endswith((f"/{name}", f"/{name}{path.suffix}"))
        assert not name.startswith("/")
        assert known_name(path, [name]) == name


def test_an_added_map_has_the_longest_name_that_is_an_end_of_its_path() -> None:
    assert known_name(Path("/x/a/map.yaml"), ("map", "a/map", "b/map")) == "a/map"
    assert known_name(Path("/x/c/map.yaml"), ("a/map", "b/map")) is None
