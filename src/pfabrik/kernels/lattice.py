"""Points of a lattice: numbered in the order in which they are met, and joined to what hangs together."""

from __future__ import annotations

from ..arrays import Ints
from ._jit import kernel, routine

# A code has the places on three axes, or on two, in so many bits each.
BITS = 20
# Points that lie near each other are near each other in the table too: bricks of so many to a side are together.
BRICK_BITS = 2
_BRICK = (1 << BRICK_BITS) - 1
_AXIS = (1 << (BITS - BRICK_BITS)) - 1
# Large primes that spread bricks over the table; their products with 18 bits fit into an integer.
_SPREAD = (73856093, 19349663, 83492791)


@routine
def slot_of(code: int) -> int:
    """Where a code is looked for first, to be taken modulo the size of the table."""
    brick, within = 0, 0
    for axis in range(3):
        place = code >> (BITS * axis)
        brick ^= ((place >> BRICK_BITS) & _AXIS) * _SPREAD[axis]
        within |= (place & _BRICK) << (BRICK_BITS * axis)
    return (brick << (3 * BRICK_BITS)) | within


@kernel
def number_points(codes: Ints, table: Ints, known: Ints, count: int, adds: bool, numbers: Ints) -> int:
    """Fill the number of each code (n,); how many are known then.

    Parameters
    ----------
    table : numbers of codes, -1 where there is none; its size is a power of two, and it is never more than half full.
    known : codes by their numbers, with room for what may come.
    count : how many are known before.
    adds : whether unknown codes are numbered on from there; or are -1.
    """
    mask = table.shape[0] - 1
    for i in range(codes.shape[0]):
        code = codes[i]
        slot = slot_of(code) & mask
        for _ in range(table.shape[0]):
            if table[slot] < 0 or known[table[slot]] == code:
                break
            slot = (slot + 1) & mask
        if table[slot] < 0 and adds:
            table[slot], known[count] = count, code
            count += 1
        numbers[i] = table[slot]
    return count


@kernel
def join(pairs: Ints, lowest: Ints) -> None:
    """Note that two points each, (n, 2), hang together: from each, `lowest` leads to the lowest that it does with."""
    for i in range(pairs.shape[0]):
        a, b = root(lowest, pairs[i, 0]), root(lowest, pairs[i, 1])
        lowest[max(a, b)] = min(a, b)


@routine
def root(lowest: Ints, i: int) -> int:
    """Where a point leads to in the end; the way there is halved for whoever comes next."""
    for _ in range(lowest.shape[0]):
        if lowest[i] == i:
            break
        lowest[i] = lowest[lowest[i]]
        i = lowest[i]
    return i
