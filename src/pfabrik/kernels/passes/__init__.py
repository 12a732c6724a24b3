"""Kernels of P-FABRIK on joint positions: passes, restrictions to limits, and projection of unreached targets."""
