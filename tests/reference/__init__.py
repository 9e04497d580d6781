"""Slow, obvious, independent answers in rational arithmetic, one file an operation.

Solids are the dictionaries of the JSON interface (``{"type": "sphere", "center": [0, 0], "radius": 1}``); numbers may
be ints, floats or rationals, and each float counts as the exact rational it is. Nothing here imports the engine: the
answers follow from the definitions alone, by methods the engine does not use, so that the two fail apart.
"""
