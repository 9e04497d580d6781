"""The textbook's own methods in plain float64, one file each: contenders in the report, never the default.

Source of all: section 22.4 of the chapter on computer graphics in Algorithms of Informatics. Each file says what goes
wrong. They take plain arrays, do not check them, and never raise; where the textbook's loop may not end it is capped.

| textbook | file |
| --- | --- |
| implicit solid f >= 0 | implicit.py |
| half-space; clipping points | half_space.py |
| convex polyhedron by half-spaces | convex.py |
| polyhedron by the parity of a half-line | polyhedron_ray_parity.py (the intersection: ray_triangle.py) |
| "find another half line" | polyhedron_recast.py |
| polygon by the parity of a half-line | polygon_ray_parity.py |
| convex polygon by the sum of angles, signed and unsigned | polygon_angle_sum.py |
| convex polygon by the same side of all edges | polygon_same_side.py |
| triangle in space by cross and scalar products | triangle_cross_dot.py |
| triangle on the projection of largest area | triangle_projection.py |
| polyhedra: vertices in the other, both ways | collide_by_vertices.py |
| polyhedra: edges against faces | collide_by_edges.py |
| bounding volumes first | collide_by_volumes.py |
| segment on a half-space | segment_half_space.py |
| Sutherland-Hodgman; multiply connected; cascade | sutherland_hodgman.py |
| Cohen-Sutherland on a box | cohen_sutherland.py |
| exercise 2: CSG tree | csg_tree.py |
| exercise 3: polygon on a concave polygon | greiner_hormann.py |
| exercise 4: bounding sphere and box | bounding_volumes.py |
| exercise 5: two triangles in the plane | triangles_in_plane.py |
| exercise 6: Cohen-Sutherland on a convex polyhedron | convex_cohen_sutherland.py |
| exercise 7: segment on a sphere | segment_sphere.py |

Exercise 1, collision in less than quadratic time, is what engine.collision does.
"""
