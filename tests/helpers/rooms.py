"""A room as a mesh file."""

ROOM = """
o room
usemtl cement
v -3 -2 0
v 3 -2 0
v 3 2 0
v -3 2 0
v -3 -2 2.5
v 3 -2 2.5
v 3 2 2.5
v -3 2 2.5
f 1 2 3 4
f 8 7 6 5
f 1 5 6 2
f 2 6 7 3
usemtl plastic
f 3 7 8 4
f 4 8 5 1
"""
