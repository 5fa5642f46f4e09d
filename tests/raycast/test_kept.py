"""What is made of pictures that many sensors see is made once, and some of what was made with other numbers is kept."""

import numpy as np
import pytest
from numpy.typing import NDArray

from depthsim.raycast import Geometry


class _Counted:
    """Makes pictures of 100 bytes, and says how many it has made."""

    def __init__(self) -> None:
        self.count = 0

    def __call__(self) -> NDArray[np.uint8]:
        self.count += 1
        return np.full(100, self.count, np.uint8)


@pytest.mark.parametrize(("room", "made"), [(0, 6), (100, 6), (200, 3), (1000, 3)])
def test_as_many_are_kept_as_there_is_room_for(room: int, made: int) -> None:
    geometry, make = Geometry.empty((10, 10), right=False), _Counted()
    geometry.kept = {}
    for _ in range(2):
        for number in range(3):
            geometry.once("a", (float(number),), make, room)
    assert make.count == made
    assert len(geometry.kept["a"]) == min(3, 1 + room // 100)


def test_what_was_asked_for_last_is_kept_without_room() -> None:
    geometry, make = Geometry.empty((10, 10), right=False), _Counted()
    geometry.kept = {}
    pictures = [geometry.once(name, (1.0,), make) for name in ("a", "a", "b", "a")]
    assert make.count == 2
    assert [int(picture[0]) for picture in pictures] == [1, 1, 2, 1]


def test_nothing_is_kept_of_pictures_that_are_written_over() -> None:
    geometry, make = Geometry.empty((10, 10), right=False), _Counted()
    for _ in range(2):
        geometry.once("a", (1.0,), make, 1000)
    assert make.count == 2
