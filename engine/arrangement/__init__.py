"""Exact planar arrangements of segments: nodes, edges, faces, labels, rings.

>>> from fractions import Fraction
>>> from engine.arrangement.arrange import arrange_segments
>>> from engine.arrangement.face_points import face_points
>>> from engine.arrangement.subdivision import label_faces, subdivide
>>> third = Fraction(1, 3)
>>> triangle = [((0, 0), (1, 0)), ((1, 0), (third, 1)), ((third, 1), (0, 0))]
>>> faces = subdivide(arrange_segments(triangle, masks=[1, 1, 1]))
>>> label_faces(faces)  # face 0 is the unbounded one; bit 0: in source 0
[0, 1]
>>> face_points(faces)[1]
(Fraction(1, 6), Fraction(1, 4))
"""
