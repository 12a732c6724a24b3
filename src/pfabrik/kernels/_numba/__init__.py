"""Numba as the compiler of kernels: imported where no compiled ones are there, and when they are built."""
