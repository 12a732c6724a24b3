"""From the address of a `Handle` to what it keeps."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, TypeVar

from ._jit import Reference, _config, _extending, _typeof, _types

R = TypeVar("R", bound=tuple[Any, ...])  # a NamedTuple of arrays


def opener(sample: R) -> Callable[[Any], R]:
    """What compiled code calls to get from the address of a `Handle` to the NamedTuple, of the types of a sample."""
    if _config.DISABLE_JIT:
        return lambda record: record
    reference = Reference(_typeof(sample))

    def open_record(typing_context: Any, address: Any) -> Any:
        def lower(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
            return builder.inttoptr(arguments[0], context.get_value_type(reference))

        return reference(_types.int64), lower

    opened: Callable[[Any], R] = _extending.intrinsic(open_record)
    return opened
