"""Products and inverses of batches of similarities, compared with those of single ones."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from mapping.geometry.similarity2 import Similarity2
from mapping.geometry.similarity2_array import Similarity2Array, rotations

metres = st.floats(-50.0, 50.0)
similarities = st.builds(Similarity2, metres, metres, st.floats(-3.1, 3.1), st.floats(0.3, 3.0))
several = st.lists(similarities, min_size=1, max_size=5)


def close(motions, expected):
    found = np.stack((motions.turn.real, -motions.turn.imag, motions.shift.real), axis=-1)
    np.testing.assert_allclose(found, [place.matrix()[0] for place in expected], atol=1e-8)
    np.testing.assert_allclose(motions.shift.imag, [place.y for place in expected], atol=1e-8)


@given(several, similarities)
def test_products_and_inverses_equal_those_of_single_similarities(places, other):
    close(Similarity2Array.of(places) @ Similarity2Array.of([other]), [place @ other for place in places])
    close(Similarity2Array.of([other]) @ Similarity2Array.of(places), [other @ place for place in places])
    close(Similarity2Array.of(places).inverse(), [place.inverse() for place in places])
    np.testing.assert_allclose(rotations(Similarity2Array.of(places).turn)[0], places[0].matrix()[:, :2], atol=1e-9)
