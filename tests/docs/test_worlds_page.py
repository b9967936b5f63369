"""docs/worlds.md lists the families of the code, and its example is a valid world."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest

from mapquilt.runs.open_world import open_world
from worlds.families.registry import FAMILIES, make_world
from worlds.floor import require_drivable

PAGE = (Path(__file__).parents[2] / "docs/worlds.md").read_text(encoding="utf-8")
ROWS = re.findall(r"^\| `(\w+)` \| ([\d.]+) x ([\d.]+) \| (.+?) \|", PAGE, flags=re.MULTILINE)


def test_every_family_has_its_row_with_its_size() -> None:
    documented = {name: (float(width), float(height)) for name, width, height, _ in ROWS}
    assert documented == {name: (family.width, family.height) for name, family in FAMILIES.items()}


@pytest.mark.parametrize(("name", "least"), [(row[0], row[3]) for row in ROWS if row[3] != "one size"])
def test_the_least_size_holds_the_family_and_less_is_refused(name: str, least: str) -> None:
    width, height = (float(each) for each in least.split(" x "))
    for seed in range(2):
        require_drivable(make_world(name, seed, width, height))
    with pytest.raises(ValueError, match=f"width is {width - 0.1:g} m, too small"):
        make_world(name, 0, width - 0.1, height)
    with pytest.raises(ValueError, match=f"height is {height - 0.1:g} m, too small"):
        make_world(name, 0, width, height - 0.1)


def test_the_example_is_a_world(tmp_path: Path) -> None:
    section = PAGE.partition("## World files")[2].partition("\n## ")[0]
    (example,) = re.findall(r"(?:^    .*\n)+", section, flags=re.MULTILINE)
    (tmp_path / "own.yaml").write_text(re.sub(r"^    ", "", example, flags=re.MULTILINE), encoding="utf-8")
    world, warnings = open_world(str(tmp_path / "own.yaml"), seed=0)
    assert (world.name, world.size, len(world.obstacles), warnings) == ("own", (8.0, 5.0), 7, ())
    assert np.allclose((world.starts[0].x, world.starts[0].y, world.starts[0].yaw), (2.0, 1.5, 1.57))
