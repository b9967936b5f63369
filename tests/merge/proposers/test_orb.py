import numpy as np
import pytest

from mapping.geometry.scale_range import ScaleRange
from mapping.geometry.se2 import SE2
from mapping.geometry.similarity2 import Similarity2
from mapping.grid.frame import GridFrame
from mapping.grid.occupancy_grid import OccupancyGrid
from merge.preparation.prepared_map import PreparedMap
from merge.proposers.keypoints import match_descriptors
from merge.proposers.orb import Orb
from tests.merge.rooms import rooms


@pytest.fixture(scope="module")
def world():
    return np.where(rooms(np.random.default_rng(11)).walls, 100, 0)


def prepare(values):
    return PreparedMap(OccupancyGrid.from_occupancy(GridFrame(1.0, SE2(), values.shape), values))


@pytest.mark.parametrize("picture", [0, 1])
def test_each_picture_alone_proposes_the_rotation(world, picture):
    method, turned = Orb(), np.rot90(world, -1)  # rows up: counter-clockwise
    target, source = method.describe(prepare(turned)), method.describe(prepare(world))
    found = method.propose(
        target[picture : picture + 1], source[picture : picture + 1], ScaleRange.free(), np.random.default_rng(0)
    )
    truth = Similarity2(float(world.shape[0]), 0.0, np.pi / 2)
    corners = np.array([(0.0, 0.0), (320.0, 0.0), (0.0, 220.0), (320.0, 220.0)])
    off = [np.abs(p.target_from_source.apply(corners) - truth.apply(corners)).max() for p in found]
    assert min(off) < 2.0


def test_bits_match_by_hamming_distance_and_ratio():
    target = np.array([[0b0000], [0b1111]], dtype=np.uint8)
    source = np.array([[0b0001], [0b0011], [0b0111]], dtype=np.uint8)  # ratios 1/3, 2/2 and 1/3
    to, of = match_descriptors(target, source, 0.9)
    assert (to.tolist(), of.tolist()) == ([0, 1], [0, 2])


def test_a_blank_map_gets_no_proposal(world):
    method = Orb()
    blank, full = method.describe(prepare(np.zeros((40, 40), dtype=int))), method.describe(prepare(world))
    for target, source in ((blank, full), (full, blank), (blank, blank)):
        assert method.propose(target, source, ScaleRange.free(), np.random.default_rng(0)) == ()


@pytest.mark.parametrize(("field", "value"), [("ratio", 1.5), ("features", 0)])
def test_a_bad_setting_is_named(field, value):
    with pytest.raises(ValueError, match=f"{field} is {value}"):
        Orb(**{field: value})
