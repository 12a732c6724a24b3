"""The compiled code, by engine: numbers in, numbers out. Imports NumPy only."""


class NoKernels(ImportError):
    """The compiled kernels that were asked for are not there; the message says what to do."""
