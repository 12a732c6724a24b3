"""The compiled code, by engine: numbers in, numbers out. Imports NumPy and Numba only."""
