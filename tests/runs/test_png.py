import io
import struct
import threading
import zlib
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp
from PIL import Image

from depthsim.errors import InputError
from depthsim.runs.png import SIGNATURE, decode_png, encode_png, is_whole_png

rng = np.random.default_rng(0)
sides = st.integers(1, 40)
images = st.one_of(
    hnp.arrays(dtype, st.tuples(sides, sides, *channels))
    for dtype, channels in ((np.uint8, ()), (np.uint8, (st.just(3),)), (np.uint16, ()))
)
deep_colour = hnp.arrays(np.uint16, st.tuples(sides, sides, st.just(3)))
"""Written, but not read back."""


def chunk(kind: bytes, body: bytes) -> bytes:
    return struct.pack(">I", len(body)) + kind + body + struct.pack(">I", zlib.crc32(kind + body))


def png(header: tuple, rows: bytes, *, parts: int = 1, extra: bytes = b"") -> bytes:
    """A PNG file, its pixels in ``parts`` chunks. header: width, height, bits, colour, 0, 0, interlaced."""
    data = zlib.compress(rows)
    step = -(-len(data) // parts)
    pixels = b"".join(chunk(b"IDAT", data[at : at + step]) for at in range(0, len(data), step))
    return SIGNATURE + chunk(b"IHDR", struct.pack(">IIBBBBB", *header)) + extra + pixels + chunk(b"IEND", b"")


def big_endian_rows(image: np.ndarray) -> np.ndarray:
    return image.astype(image.dtype.newbyteorder(">")).view(np.uint8).reshape(len(image), -1)


def filtered(image: np.ndarray, kinds: list[int]) -> bytes:
    """The rows under the reported filters, straight from the PNG specification, one byte at a time."""
    rows = big_endian_rows(image).astype(int)
    step = rows.shape[1] // image.shape[1]
    out = bytearray()
    for y, kind in enumerate(kinds):
        out.append(kind)
        for i, value in enumerate(rows[y]):
            a = rows[y, i - step] if i >= step else 0
            b = rows[y - 1, i] if y else 0
            c = rows[y - 1, i - step] if y and i >= step else 0
            paeth = min(
                (a, b, c), key=lambda near, p=a + b - c: abs(p - near)
            )  # min keeps the first: a, then b, then c
            out.append((value - [0, a, b, (a + b) // 2, paeth][kind]) % 256)
    return bytes(out)


@given(images)
def test_round_trip_to_the_bit(image):
    back = decode_png(encode_png(image))
    assert back.dtype == image.dtype
    np.testing.assert_array_equal(back, image)


@given(images)
@settings(max_examples=40)
def test_pillow_reads_ours(image):
    np.testing.assert_array_equal(np.asarray(Image.open(io.BytesIO(encode_png(image)))), image)


@given(images | deep_colour)
@settings(max_examples=40)
def test_opencv_reads_ours_and_we_read_opencv(image):
    cv2 = pytest.importorskip("cv2", reason="OpenCV is not installed")
    theirs = cv2.imdecode(np.frombuffer(encode_png(image), np.uint8), cv2.IMREAD_UNCHANGED)
    np.testing.assert_array_equal(theirs if image.ndim == 2 else theirs[..., ::-1], image)
    data = cv2.imencode(".png", image)[1].tobytes()
    if image.ndim == 3 and image.dtype == np.uint16:
        with pytest.raises(InputError, match="16-bit PNG in colour"):
            decode_png(data)
        return
    np.testing.assert_array_equal(decode_png(data), image if image.ndim == 2 else image[..., ::-1])


@pytest.mark.parametrize("shape", [(31, 17), (31, 17, 3)])
@pytest.mark.parametrize("level", [0, 1, 9])
def test_we_read_pillow(shape, level):
    smooth = np.cumsum(rng.integers(0, 3, shape), axis=1)
    for image in (smooth.astype(np.uint8), *([(smooth * 50).astype(np.uint16)] if len(shape) == 2 else [])):
        file = io.BytesIO()
        Image.fromarray(image).save(file, "PNG", compress_level=level)
        np.testing.assert_array_equal(decode_png(file.getvalue()), image)


@given(images, st.data())
@settings(max_examples=40)
def test_all_five_filters(image, data):
    image = image[:8, :9]
    kinds = data.draw(st.lists(st.integers(0, 4), min_size=len(image), max_size=len(image)))
    header = (image.shape[1], len(image), 8 * image.itemsize, 2 if image.ndim == 3 else 0, 0, 0, 0)
    file = png(header, filtered(image, kinds), parts=3, extra=chunk(b"tEXt", b"Comment\0by another program"))
    np.testing.assert_array_equal(decode_png(file), image)


@pytest.mark.parametrize(("dtype", "channels"), [(np.uint8, ()), (np.uint8, (3,)), (np.uint16, ())])
def test_interlaced(dtype, channels):
    image = rng.integers(0, np.iinfo(dtype).max, (13, 11, *channels), dtype=dtype)
    passes = [(0, 0, 8, 8), (0, 4, 8, 8), (4, 0, 8, 4), (0, 2, 4, 4), (2, 0, 4, 2), (0, 1, 2, 2), (1, 0, 2, 1)]
    rows = b"".join(
        b"\0" + row.tobytes()
        for y, x, down, right in passes
        for row in big_endian_rows(np.ascontiguousarray(image[y::down, x::right]))
    )
    file = png((11, 13, 8 * image.itemsize, 2 if channels else 0, 0, 0, 1), rows)
    np.testing.assert_array_equal(decode_png(file), image)


def test_other_kinds_that_are_exact():
    def through_pillow(picture):
        file = io.BytesIO()
        picture.save(file, "PNG")
        return decode_png(file.getvalue())

    grey, rgb = rng.integers(0, 256, (9, 7), dtype=np.uint8), rng.integers(0, 256, (9, 7, 3), dtype=np.uint8)
    np.testing.assert_array_equal(through_pillow(Image.fromarray(grey > 99)), np.where(grey > 99, 255, 0))
    np.testing.assert_array_equal(through_pillow(Image.fromarray(np.dstack([grey, 255 - grey]))), grey)
    np.testing.assert_array_equal(through_pillow(Image.fromarray(np.dstack([rgb, grey]))), rgb)
    coarse = Image.fromarray(rgb // 128 * 255)
    np.testing.assert_array_equal(through_pillow(coarse.convert("P", palette=Image.Palette.WEB)), rgb // 128 * 255)
    four_bits = png((4, 2, 4, 0, 0, 0, 0), bytes([0, 0x01, 0x23, 0, 0xEF, 0x80]))
    np.testing.assert_array_equal(decode_png(four_bits), [[0, 17, 34, 51], [238, 255, 136, 0]])


small = encode_png(rng.integers(0, 65536, (3, 4), dtype=np.uint16))


def test_a_file_cut_anywhere_is_found(tmp_path):
    file = tmp_path / "cut.png"
    for length in range(len(small)):
        file.write_bytes(small[:length])
        assert not is_whole_png(file)
        with pytest.raises(InputError, match=r"cut\.png: is (empty|not a PNG|a damaged PNG)"):
            decode_png(file)
    file.write_bytes(small)
    assert is_whole_png(file)
    assert not is_whole_png(tmp_path / "none.png")
    assert not is_whole_png(tmp_path)


def test_a_byte_changed_anywhere_is_found():
    for at in range(len(small)):
        bad = bytearray(small)
        bad[at] ^= 0x10
        with pytest.raises(InputError):
            decode_png(bytes(bad))


grey8 = (4, 4, 8, 0, 0, 0, 0)


@pytest.mark.parametrize(
    ("data", "problem"),
    [
        (b"", "is empty"),
        (b"\xff\xd8\xff\xe0 a photograph", "is not a PNG"),
        (png(grey8, b"\0" * 19), "damaged PNG"),
        (png(grey8, b"\5" + b"\0" * 19), "damaged PNG"),
        (png((4, 2, 4, 0, 0, 0, 0), b"\0" * 6)[:-12] + chunk(b"iCCP", b"a\0") + chunk(b"IEND", b""), "damaged PNG"),
        (png((0, 4, 8, 0, 0, 0, 0), b""), "claims to be 0x4"),
        (png((1 << 30, 1 << 30, 8, 0, 0, 0, 0), b""), "claims to be"),
        (png((2, 1, 16, 6, 0, 0, 0), b"\0" * 17), "16-bit PNG in colour"),
        (png((2, 1, 16, 2, 0, 0, 1), b"\0" * 17), "16-bit PNG in colour"),
        (png((2, 1, 7, 0, 0, 0, 0), b"\0" * 3), "damaged"),
        (png((2, 2, 8, 6, 0, 0, 0), b"\0" * 3), "damaged"),
        (SIGNATURE + chunk(b"IEND", b""), "header"),
        (SIGNATURE + chunk(b"IHDR", b"short") + chunk(b"IEND", b""), "header"),
        (SIGNATURE + chunk(b"IHDR", struct.pack(">IIBBBBB", *grey8)) + chunk(b"IEND", b""), "damaged"),
        (
            SIGNATURE
            + chunk(b"IHDR", struct.pack(">IIBBBBB", *grey8))
            + chunk(b"IDAT", b"not deflate")
            + chunk(b"IEND", b""),
            "damaged PNG",
        ),
    ],
)
def test_bad_files(data, problem):
    with pytest.raises(InputError, match=problem):
        decode_png(data)


def test_files_that_cannot_be_read(tmp_path):
    for path in (tmp_path / "none.png", tmp_path):
        with pytest.raises(InputError, match=str(path)):
            decode_png(path)


@pytest.mark.parametrize(
    "image",
    [np.zeros((0, 4), np.uint8), np.zeros(4, np.uint8), np.zeros((4, 4), np.float32), np.zeros((4, 4, 4), np.uint8)],
)
def test_what_is_no_picture_is_refused(image):
    with pytest.raises(ValueError, match="a PNG is"):
        encode_png(image)


def test_layout_in_memory_and_threads_do_not_change_the_bytes():
    image = rng.integers(0, 4000, (200, 300), dtype=np.uint16)
    data = encode_png(image)
    assert encode_png(np.asfortranarray(image)) == data
    assert encode_png(image[::-1][::-1]) == data
    with ThreadPoolExecutor(4) as pool:
        assert set(pool.map(lambda _: encode_png(image), range(16))) == {data}


def test_where_a_thread_has_its_stack_does_not_change_the_bytes():
    """The packer hashes an address unless it is kept from it: then about 8 of these 8,000 pictures are others."""
    walls = [np.full((4, 40), value, np.uint16) for value in range(500, 540)]
    expected, together, wrong = [encode_png(wall) for wall in walls], threading.Barrier(200), []

    def encode():
        together.wait()  # all threads are there at once, so that each has a stack of its own
        wrong.extend(wall[0, 0] for wall, file in zip(walls, expected, strict=True) if encode_png(wall) != file)

    threads = [threading.Thread(target=encode) for _ in range(together.parties)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert not wrong


def test_open3d_reads_ours(tmp_path: Path):
    try:
        import ctypes

        import libusb_package

        ctypes.CDLL(str(libusb_package.get_library_path()), mode=ctypes.RTLD_GLOBAL)
        import open3d
    except (ImportError, OSError):
        pytest.skip("Open3D is not installed")
    image = rng.integers(0, 65536, (20, 30), dtype=np.uint16)
    (tmp_path / "depth.png").write_bytes(encode_png(image))
    np.testing.assert_array_equal(np.asarray(open3d.io.read_image(str(tmp_path / "depth.png"))), image)
