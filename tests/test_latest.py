"""What was computed at one place is kept for the second question."""

import numpy as np
from scipy.optimize import least_squares

from fitting.least_squares.latest import latest_kept


def test_it_looks_once_where_scipy_asks_for_rows_and_slopes_in_turn():
    places = []

    @latest_kept
    def both(place):
        places.append(tuple(place))
        return np.array([place[0] - 1.0, 10 * (place[1] - place[0] ** 2)]), np.array([[1, 0], [-20 * place[0], 10]])

    found = least_squares(lambda x: both(x)[0], [-1.2, 1.0], lambda x: both(x)[1], method="dogbox", bounds=(-2, 2))
    np.testing.assert_allclose(found.x, 1.0)
    assert len(places) == found.nfev  # every accepted place was also asked for slopes


def test_a_place_that_was_left_is_looked_at_again():
    places = []
    seen = latest_kept(lambda place: places.append(place) or len(places))
    assert [seen(np.array([x])) for x in (0.0, 0.0, 1.0, 0.0)] == [1, 1, 2, 3]


def test_an_array_that_changes_is_another_place():
    """scipy may write the next place into the array of the one before."""
    seen, place = latest_kept(lambda place: float(place[0])), np.array([1.0])
    assert seen(place) == 1.0
    place[0] = 2.0
    assert seen(place) == 2.0
