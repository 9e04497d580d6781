"""Exact answers to four questions about a scene: containment, collision, segment clipping, polygon clipping."""

from engine.version import __version__

__all__ = ["__version__"]
