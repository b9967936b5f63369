import cv2
import numpy as np

from mapping.geometry.se2 import SE2
from mapping.geometry.similarity2 import Similarity2
from mapping.grid.frame import GridFrame
from mapping.grid.occupancy_grid import OccupancyGrid
from mapping.grid.pixel_matrix import pixel_matrix
from merge.preparation.map_image import cells_from_pixels, trinary_picture


def test_rows_are_flipped_and_there_are_three_greys():
    grid = OccupancyGrid.from_occupancy(GridFrame(1.0, SE2(), (2, 3)), [[100, 0, -1], [0, 0, 0]])
    picture = trinary_picture(grid)
    assert picture.tolist() == [[255, 255, 255], [0, 255, 128]]
    assert picture.dtype == np.uint8


def test_pixel_zero_of_the_last_row_is_the_centre_of_cell_zero():
    assert cells_from_pixels(np.array([(0.0, 4.0), (2.0, 0.0)]), 5).tolist() == [[0.5, 0.5], [2.5, 4.5]]
    one = cells_from_pixels(np.array([(0.0, 0.0)]), 1)
    assert one.tolist() == [[0.5, 0.5]]


def test_the_pixel_matrix_of_a_quarter_turn_warps_one_picture_into_the_other():
    values = np.full((40, 60), 0)
    values[5:30, 10:14] = 100  # an L: upright bar, and its foot to the right
    values[5:9, 10:40] = 100
    source = OccupancyGrid.from_occupancy(GridFrame(1.0, SE2(), values.shape), values)
    turned = np.rot90(values, -1)  # rows up: the array turned clockwise as printed is counter-clockwise on the map
    target = OccupancyGrid.from_occupancy(GridFrame(1.0, SE2(), turned.shape), turned)
    target_from_source = Similarity2(40.0, 0.0, np.pi / 2)
    matrix = pixel_matrix(target.frame, target_from_source, source.frame)
    warped = cv2.warpAffine(trinary_picture(source), matrix, target.frame.shape[::-1], flags=cv2.INTER_NEAREST)
    np.testing.assert_array_equal(warped, trinary_picture(target))
    assert np.arctan2(matrix[1, 0], matrix[0, 0]) == -np.pi / 2
