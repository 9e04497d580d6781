"""JSON text into Python values, its long arrays of numbers into ndarrays."""
