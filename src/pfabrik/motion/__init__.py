"""Where bodies are and how they move to first order, in plain NumPy: the referee of what the kernels find."""
