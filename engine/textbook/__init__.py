"""The textbook's own methods in plain float64: contenders in the report, never the default.

Source of all: section 22.4 of the chapter on computer graphics in Algorithms of Informatics. Each function says what
goes wrong. They take plain arrays, do not check them, and never raise; where the textbook's loop may not end it is
capped.

| textbook | function |
| --- | --- |
| implicit solid f >= 0; half-space; clipping points | solids.in_implicit, in_half_space, clip_points |
| convex polyhedron by half-spaces; exercise 2: CSG tree | solids.in_convex, in_csg_tree |
| polyhedron by the parity of a half-line; "find another half line" | polyhedra.by_half_line, by_other_half_lines |
| polygon by the parity of a half-line | polygons.by_half_line |
| convex polygon by the sum of angles, signed and unsigned | polygons.by_signed_angles, by_unsigned_angles |
| convex polygon by the same side of all edges | polygons.by_same_side |
| triangle in space by cross and scalar products | solids.by_products |
| triangle on the projection of largest area | solids.by_projection |
| polyhedra: vertices in the other, edges against faces | collision.by_vertices, by_edges |
| bounding volumes first; exercise 4: bounding sphere and box | collision.by_volumes, bounding_sphere |
| exercise 5: two triangles in the plane | collision.of_triangles |
| segment on a half-space; exercise 7: on a sphere | clip_segments.on_half_space, on_sphere |
| Cohen-Sutherland on a box; exercise 6: on a convex polyhedron | clip_segments.on_box, on_convex |
| Sutherland-Hodgman; multiply connected; cascade | clip_polygons.clip_contour, clip_polygon, on_convex |
| exercise 3: polygon on a concave polygon | clip_polygons.intersection |

Exercise 1, collision in less than quadratic time, is what engine.collision does.
"""
