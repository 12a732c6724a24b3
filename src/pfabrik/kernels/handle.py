"""What Python gives kernels of a machine: an address."""

from __future__ import annotations

from typing import Any, Generic, TypeVar

import numpy as np

R = TypeVar("R", bound=tuple[Any, ...])  # a NamedTuple of arrays


class Handle(Generic[R]):
    """A NamedTuple of arrays kept in memory as compiled code has it.

    A kernel takes its `address`, a number, and opens it; from Python that costs a tenth of what the arrays would. The
    arrays are kept alive, and may be written to; whoever hands the address over keeps the handle until the kernel is
    done.
    """

    def __init__(self, record: R) -> None:
        import numba

        config: Any = numba.config
        self.record = record
        self._memory = np.array([number for array in record for number in _descriptor(array)], dtype=np.int64)
        self.address: Any = record if config.DISABLE_JIT else self._memory.ctypes.data

    def __reduce__(self) -> tuple[Any, ...]:
        """A copy has arrays of its own, and their addresses."""
        return Handle, (self.record,)


def _descriptor(array: Any) -> tuple[int, ...]:
    """An array as Numba has it in memory: no owner, size, bytes of an element, where it is, shape, strides."""
    assert array.flags.c_contiguous and array.flags.writeable
    return (0, 0, array.size, array.itemsize, array.ctypes.data, *array.shape, *array.strides)
