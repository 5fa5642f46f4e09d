"""The Embree 4 library inside the embreex wheel, by ctypes: device, scene, and the addresses that the kernel calls."""

import ctypes
import os
import weakref
from functools import cache
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from depthsim.errors import InputError

_TRIANGLE, _INDEX, _VERTEX = 0, 0, 1
_UINT3, _FLOAT3 = 0x5003, 0x9003
_ROBUST = 4
"""Without RTC_SCENE_FLAG_ROBUST rays slip through shared edges, and the holes measured are the ray caster's."""
_MEDIUM_QUALITY = 1
_COHERENT = 1 << 16
_TRIANGLE_FEATURE = 1 << 1
_NATIVE = {16: 34, 8: 33, 4: 32}
"""Lanes of a packet -> the device's property that says whether it takes such packets whole."""

_Pointer = ctypes.c_void_p
_SIGNATURES: dict[str, tuple[type | None, list[type]]] = {
    "rtcNewDevice": (_Pointer, [ctypes.c_char_p]),
    "rtcGetDeviceError": (ctypes.c_int, [_Pointer]),
    "rtcGetDeviceProperty": (ctypes.c_ssize_t, [_Pointer, ctypes.c_int]),
    "rtcNewScene": (_Pointer, [_Pointer]),
    "rtcSetSceneFlags": (None, [_Pointer, ctypes.c_int]),
    "rtcSetSceneBuildQuality": (None, [_Pointer, ctypes.c_int]),
    "rtcNewGeometry": (_Pointer, [_Pointer, ctypes.c_int]),
    "rtcSetSharedGeometryBuffer": (
        None,
        [_Pointer, ctypes.c_int, ctypes.c_uint, ctypes.c_int, _Pointer, *[ctypes.c_size_t] * 3],
    ),
    "rtcCommitGeometry": (None, [_Pointer]),
    "rtcAttachGeometry": (ctypes.c_uint, [_Pointer, _Pointer]),
    "rtcReleaseGeometry": (None, [_Pointer]),
    "rtcCommitScene": (None, [_Pointer]),
    "rtcReleaseScene": (None, [_Pointer]),
}


class EmbreeMissing(RuntimeError):
    """The library could not be found or loaded; the caster then falls back on embreex's own call."""


@cache
def _library() -> ctypes.CDLL:
    import embreex

    package = Path(embreex.__file__).parent
    # Where the wheel tools of Linux, macOS and Windows put a package's libraries.
    folders = [package.parent / "embreex.libs", package / ".dylibs", package]
    found = [file for folder in folders for file in sorted(folder.glob("*embree4*")) if ".cpython" not in file.name]
    if not found:
        raise EmbreeMissing("the embreex package brings no embree4 library")
    try:
        library = ctypes.CDLL(str(found[0]))
        for name, (result, arguments) in _SIGNATURES.items():
            function = getattr(library, name)
            function.restype, function.argtypes = result, arguments
    except (OSError, AttributeError) as error:
        raise EmbreeMissing(str(error)) from error
    return library


def _device() -> int:
    """The device that DEPTHSIM_EMBREE_CONFIG asks for, such as ``isa=avx2``; the processor's best without it."""
    return _device_of(os.environ.get("DEPTHSIM_EMBREE_CONFIG", ""))


@cache
def _device_of(configuration: str) -> int:
    device = _library().rtcNewDevice(configuration.encode() or None)
    if device:
        return int(device)
    if configuration:
        fix = "give Embree's own settings, such as isa=avx2"
        raise InputError("DEPTHSIM_EMBREE_CONFIG", "", f"Embree refuses {configuration!r}", fix)
    raise EmbreeMissing("Embree found no device that it can run on")


def packet_lanes() -> int:
    """How many rays a packet should hold: 16, 8 or 4, the most that the device takes whole; or DEPTHSIM_PACKET.

    Embree takes a wider packet apart into single rays: on a processor without AVX-512 packets of 8 are twice as fast
    as those of 16. What the rays hit does not depend on it.
    """
    forced = os.environ.get("DEPTHSIM_PACKET")
    if forced:
        if forced not in map(str, _NATIVE):
            raise InputError("DEPTHSIM_PACKET", "", f"there are no packets of {forced!r}", "use 16, 8 or 4")
        return int(forced)
    device = _device()
    return next((n for n, native in _NATIVE.items() if _library().rtcGetDeviceProperty(device, native)), min(_NATIVE))


def address(name: str) -> int:
    """The address of one of the library's functions."""
    return int(ctypes.cast(getattr(_library(), name), _Pointer).value or 0)


def aligned(shape: tuple[int, ...], dtype: type[np.generic]) -> NDArray:
    """Zeros that begin at a multiple of 64 bytes, as Embree's 16-wide structures must."""
    size = int(np.prod(shape)) * np.dtype(dtype).itemsize
    raw = np.zeros(size + 64, np.uint8)
    start = -raw.ctypes.data % 64
    return raw[start : start + size].view(dtype).reshape(shape)


def all_lanes() -> NDArray[np.int32]:
    """The mask under which every ray of a packet is cast."""
    valid = aligned((16,), np.int32)
    valid[:] = -1
    return valid


def query_arguments() -> NDArray[np.int32]:
    """RTCIntersectArguments, which RTCOccludedArguments equals: coherent rays, triangles only, no callbacks."""
    arguments = aligned((16,), np.int32)
    arguments[0], arguments[1] = _COHERENT, _TRIANGLE_FEATURE
    return arguments


class EmbreeScene:
    """The acceleration structure over triangles; it keeps the two arrays, which Embree reads in place.

    centre, radius: of a sphere about all vertices [m].
    """

    def __init__(self, vertices: NDArray[np.float64], faces: NDArray[np.uint32]) -> None:
        library = _library()
        # Embree reads 16 bytes a vertex, so one more row stands behind the last.
        self._vertices = np.zeros((len(vertices) + 1, 3), np.float32)
        self._vertices[:-1] = vertices
        low, high = (vertices.min(axis=0), vertices.max(axis=0)) if len(vertices) else (np.zeros(3), np.zeros(3))
        self.centre, self.radius = (low + high) / 2, float(np.linalg.norm(high - low)) / 2
        self._faces = np.ascontiguousarray(faces, np.uint32)
        device = _device()
        self.handle = int(library.rtcNewScene(device))
        self._release = weakref.finalize(self, library.rtcReleaseScene, self.handle)
        library.rtcSetSceneFlags(self.handle, _ROBUST)
        library.rtcSetSceneBuildQuality(self.handle, _MEDIUM_QUALITY)
        geometry = library.rtcNewGeometry(device, _TRIANGLE)
        for kind, form, array, count in (
            (_VERTEX, _FLOAT3, self._vertices, len(vertices)),
            (_INDEX, _UINT3, self._faces, len(faces)),
        ):
            library.rtcSetSharedGeometryBuffer(geometry, kind, 0, form, array.ctypes.data, 0, 12, count)
        library.rtcCommitGeometry(geometry)
        library.rtcAttachGeometry(self.handle, geometry)
        library.rtcReleaseGeometry(geometry)
        library.rtcCommitScene(self.handle)
        error = library.rtcGetDeviceError(device)
        if error:
            raise MemoryError(f"Embree could not build the scene of {len(faces)} faces (error {error})")
