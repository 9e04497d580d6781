"""A gear pushed to a wall: every pose is decided exactly, and a contact is not an overlap."""

import numpy as np
from drawing import GREY, ORANGE, PALE_GREY, RED, Canvas

import exact_geometry as eg

angles = np.linspace(0, 2 * np.pi, 24, endpoint=False)
radii = np.where(np.arange(24) % 2, 0.75, 1.0)
gear = np.stack([radii * np.cos(angles), radii * np.sin(angles)], axis=1)
shifts = [-0.6, -0.3, 0.0, 2.0**-53, 0.3]
relations = eg.collide_poses(
    eg.Aabb(min=(1.0, -1.5), max=(1.3, 1.5)), eg.Polygon([gear]),
    rotations=np.broadcast_to(np.eye(2), (len(shifts), 2, 2)), translations=[(shift, 0.0) for shift in shifts],
)  # fmt: skip

canvas = Canvas((-3.6, -1.7), (1.6, 1.7), 640)
canvas.rings([[(1.0, -1.5), (1.3, -1.5), (1.3, 1.5), (1.0, 1.5)]], PALE_GREY)
for row, (shift, relation) in enumerate(zip(shifts, relations)):
    label = eg.Relation(relation).label
    colour = {"disjoint": GREY, "touching": ORANGE}.get(label, RED)
    canvas.rings([gear + np.array([shift, 0.0])], "none", colour, 2)
    canvas.text((-3.5, 1.4 - 0.2 * row), f"x = {shift:.3g}: {label}", colour)
canvas.save("first_contact")
