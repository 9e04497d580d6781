"""Hard cases: data, the transformations that multiply them, and the one runner."""
