"""How rays lie in Embree's packets of 16, 8 or 4, and the pixels of a tile in the packets."""

FIELDS = 22
"""RTCRayHitN is 20 fields of N numbers, 21 where Embree was built with instance arrays; the last one is ours."""
ORIGIN_X, ORIGIN_Y, ORIGIN_Z, NEAR, DIRECTION_X, DIRECTION_Y, DIRECTION_Z, TIME, FAR, MASK, ID, FLAGS = range(12)
"""The fields of RTCRayN, the first part of RTCRayHitN; field f of lane i stands at f · N + i."""
NORMAL_X, NORMAL_Y, NORMAL_Z, BARYCENTRIC, _BARYCENTRIC_V, PRIMITIVE, GEOMETRY, INSTANCE = range(12, 20)
MISSED = 21
TOWARD = 20
"""Embree writes there, if at all, once a ray has met something, and nobody reads it."""

TILE = 4
"""A tile is 4x4 pixels, whatever a packet holds, so that what is decided by the tile does not depend on the processor.
Squares share more of the tree than strips: 16x1 took 1.3 times as long."""
PIXELS = TILE * TILE
ACROSS = {16: 4, 8: 4, 4: 2}
"""The pixels of a packet's row: 4x4, 4x2 or 2x2 are one packet, and one, two or four packets a tile."""
