"""Files in and out: meshes, JSON and GeoJSON solids, tables of numbers. Used by the command line and the service."""
