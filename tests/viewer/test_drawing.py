"""Pictures of the 3D view, for browsers without a GPU."""

import numpy as np

from viewer.drawing import Drawing, View

NOTHING = (20, 20, 20)
RED, GREEN = (250, 0, 0), (0, 250, 0)
HOME = np.eye(4)


def view(width: int = 120, height: int = 80, focal: float = 100.0) -> View:
    return View(np.eye(4), width, height, focal)


def dots(*places: tuple[float, float, float]) -> np.ndarray:
    return np.array(places, np.float32)


def coloured(colour: tuple[int, int, int], count: int = 1) -> np.ndarray:
    return np.tile(np.array(colour, np.uint8), (count, 1))


def where(picture: np.ndarray, colour: tuple[int, int, int]) -> np.ndarray:
    return np.argwhere((picture == colour).all(axis=2))


def test_a_point_is_a_square_of_its_size_where_the_pinhole_has_it() -> None:
    drawing = Drawing(view())
    drawing.points(dots((0.5, -0.2, 2.0)), coloured(RED), 0.06, HOME)
    # 120 / 2 + 100 * 0.5 / 2 = 85, 80 / 2 - 100 * 0.2 / 2 = 30, and 2 * 0.06 m at 2 m are 6 px.
    rows, columns = where(drawing.picture(NOTHING), RED).T
    assert (rows.min(), rows.max(), columns.min(), columns.max()) == (27, 32, 82, 87)
    assert len(rows) == 36


def test_the_nearest_of_two_is_seen_whichever_comes_first() -> None:
    for order in (1, -1):
        drawing = Drawing(view())
        for depth, colour in [(2.0, RED), (1.0, GREEN)][::order]:
            drawing.points(dots((0, 0, depth)), coloured(colour), 0.1, HOME)
        picture = drawing.picture(NOTHING)
        assert len(where(picture, GREEN)) == 400
        assert len(where(picture, RED)) == 0


def test_what_lies_behind_or_beside_is_not_drawn_and_what_is_far_is_a_pixel() -> None:
    drawing = Drawing(view())
    drawing.points(dots((0, 0, -1), (0.7, 0, 1), (0, -0.5, 1)), coloured(RED, 3), 0.2, HOME)
    assert (drawing.picture(NOTHING) == NOTHING).all()
    drawing.points(dots((0, 0, 90)), coloured(RED), 1e-6, HOME)
    assert len(where(drawing.picture(NOTHING), RED)) == 1


def test_a_view_that_is_turned_and_moved_sees_what_a_camera_there_would() -> None:
    pose = np.eye(4)
    pose[:3, :3] = np.array([[0, 0, 1], [-1, 0, 0], [0, -1, 0]])  # looks along the world's x, with z up
    pose[:3, 3] = 1.0, 2.0, 3.0
    drawing = Drawing(View(pose, 120, 80, 100.0))
    moved = np.eye(4)
    moved[0, 3] = 1.0
    drawing.points(dots((2.0, 1.8, 3.1)), coloured(RED), 0.04, moved)  # 2 m ahead, 0.2 m right, 0.1 m up
    np.testing.assert_array_equal(where(drawing.picture(NOTHING), RED).mean(axis=0) + 0.5, [40 - 5, 60 + 10])


def test_points_are_the_same_whatever_the_number_of_threads(monkeypatch) -> None:  # type: ignore[no-untyped-def]
    draws = np.random.default_rng(3)
    points = draws.uniform((-2, -2, -1), (2, 2, 4), (5000, 3)).astype(np.float32)
    colours = draws.integers(0, 255, (5000, 3), np.uint8)
    pictures = []
    for threads in (1, 2, 7):
        monkeypatch.setattr("viewer.drawing.core_count", lambda threads=threads: threads)
        drawing = Drawing(view())
        drawing.points(points, colours, 0.02, HOME)
        pictures.append(drawing.picture(NOTHING))
    assert (pictures[0] != NOTHING).any(axis=2).mean() > 0.2
    np.testing.assert_array_equal(pictures[0], pictures[1])
    np.testing.assert_array_equal(pictures[0], pictures[2])


def test_a_line_is_whole_and_hidden_where_something_is_before_it() -> None:
    drawing = Drawing(view())
    drawing.lines(np.array([[[-3.0, 0, 4.0], [3.0, 0, 4.0]]]), RED, HOME)  # from side to side, and beyond
    rows, columns = where(drawing.picture(NOTHING), RED).T
    assert set(rows) == {39, 40}
    assert set(columns) == set(range(120))
    drawing.points(dots((0, 0, 2.0)), coloured(GREEN), 0.1, HOME)
    assert set(where(drawing.picture(NOTHING), RED)[:, 1]) == set(range(55)) | set(range(65, 120))


def test_a_line_towards_and_past_the_eye_has_its_depth_along_it() -> None:
    drawing = Drawing(view())
    drawing.lines(np.array([[[0.2, 0.1, -1.0], [0.2, 0.1, 5.0]]]), RED, HOME)
    drawing.points(dots((0.2, 0.1, 1.0)), coloured(GREEN), 0.02, HOME)  # lies on the line, before all that is farther
    picture = drawing.picture(NOTHING)
    assert tuple(picture[40 + 5, 60 + 10]) == RED  # 2 m away
    assert tuple(picture[40 + 8, 60 + 18]) == GREEN  # the point is nearer than that part of the line
    assert tuple(picture[40 + 15, 60 + 30]) == RED  # 0.67 m away
    assert (where(picture, RED)[:, 1] >= 63).all()  # where it ends, 5 m away
