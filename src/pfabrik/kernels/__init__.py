"""The reaching engine, compiled: positions in, positions out. Imports NumPy and Numba only."""
