"""Exact planar arrangements of segments: nodes, edges, faces, labels, rings."""
