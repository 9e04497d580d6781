"""How far apart two bodies are: a traversal in floats with proven bounds, and an exact stage for what it leaves."""
