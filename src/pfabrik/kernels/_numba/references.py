"""NamedTuples of arrays by reference: arguments of parts of kernels, and the contents of a `Handle`."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, TypeVar

import numba
from llvmlite import ir
from numba import extending
from numba.core import cgutils, imputils, types
from numba.core.typing.templates import AttributeTemplate

_ir: Any = ir
_types: Any = types
_cgutils: Any = cgutils
_imputils: Any = imputils
_extending: Any = extending
_AttributeTemplate: Any = AttributeTemplate
_typeof: Any = numba.typeof

R = TypeVar("R", bound=tuple[Any, ...])  # a NamedTuple of arrays


class Reference(_types.Type):
    """Numba's type of a NamedTuple of arrays by reference: a pointer to memory that its owner keeps alive.

    Compiled code reads it like the NamedTuple, and converts one into it at calls. By value, every array would be seven
    or more arguments of every function on the way.
    """

    def __init__(self, record: Any) -> None:
        self.record = record
        super().__init__(f"Reference({record.name})")


@_extending.register_model(Reference)
class _ReferenceModel(_extending.models.PrimitiveModel):
    def __init__(self, manager: Any, reference: Any) -> None:
        super().__init__(manager, reference, manager.lookup(reference.record).get_value_type().as_pointer())


@_extending.infer_getattr
class _ReferenceAttribute(_AttributeTemplate):
    key = Reference

    def generic_resolve(self, reference: Any, name: str) -> Any:
        fields = reference.record.fields
        return argument_type(reference.record.types[fields.index(name)]) if name in fields else None


@_extending.lower_getattr_generic(Reference)
def _load_field(context: Any, builder: Any, reference: Any, pointer: Any, name: str) -> Any:
    index = reference.record.fields.index(name)
    field_type, field = reference.record.types[index], _cgutils.gep_inbounds(builder, pointer, 0, index)
    if isinstance(field_type, _types.BaseNamedTuple):
        return field
    return _imputils.impl_ret_borrowed(context, builder, field_type, builder.load(field))


@_extending.lower_cast(_types.BaseNamedTuple, Reference)
def _refer(context: Any, builder: Any, record: Any, reference: Any, value: Any) -> Any:
    """Address that a NamedTuple was loaded from, if any; LLVM takes long to copy it, array by array."""
    if isinstance(value, _ir.LoadInstr) and isinstance(value.operands[0], _ir.AllocaInstr):
        return value.operands[0]
    return _cgutils.alloca_once_value(builder, value)


def argument_type(given: Any) -> Any:
    """Type by which a part takes an argument: literals lose their value, a NamedTuple becomes a reference."""
    given = _types.unliteral(given)
    return Reference(given) if isinstance(given, _types.BaseNamedTuple) else given


def opener(sample: R) -> Callable[[Any], R]:
    """Compiled function from the address of a `Handle` to its NamedTuple, with the types of a sample."""
    reference = Reference(_typeof(sample))

    def open_record(typing_context: Any, address: Any) -> Any:
        def lower(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
            return builder.inttoptr(arguments[0], context.get_value_type(reference))

        return reference(_types.int64), lower

    opened: Callable[[Any], R] = _extending.intrinsic(open_record)
    return opened
