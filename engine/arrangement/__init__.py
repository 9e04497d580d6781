"""Exact planar arrangements of segments: nodes, edges, faces, labels, rings.

>>> import numpy as np
>>> from engine.arrangement.arrange import arrange_rings
>>> from engine.arrangement.subdivision import label_faces, subdivide
>>> triangle = np.array([(0.0, 0.0), (1.0, 0.0), (0.3, 1.0)])
>>> label_faces(subdivide(arrange_rings(triangle, [0, 3], [1])))  # face 0 is the unbounded one; bit 0: in source 0
[0, 1]
"""
