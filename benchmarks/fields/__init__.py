"""The contests of the report, one file an operation; each has ``contests(seed, scale) -> Iterator[Contest]``.

scale: 1.0 for the record, less for a quick run with fewer items.
"""
