"""Distance of two bodies: a tree traversal in floats with proven bounds, and an exact stage for what it leaves open."""
