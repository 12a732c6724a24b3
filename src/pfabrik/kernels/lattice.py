"""Lattice points: numbered in the order of discovery, and joined into connected components."""

from __future__ import annotations

from ..common.arrays import Ints
from ._jit import kernel, routine

# A code holds the coordinates on two or three axes, in this many bits each.
BITS = 20
# Neighbouring points are neighbours in the hash table: bricks of 2^BRICK_BITS points a side are stored together.
BRICK_BITS = 2
_BRICK = (1 << BRICK_BITS) - 1
_AXIS = (1 << (BITS - BRICK_BITS)) - 1
# Large primes that spread bricks over the table; their products with 18 bits fit into 64.
_SPREAD = (73856093, 19349663, 83492791)


@routine
def slot_of(code: int) -> int:
    """Slot where the search for a code starts, before the modulus by the table's size."""
    brick, within = 0, 0
    for axis in range(3):
        coordinate = code >> (BITS * axis)
        brick ^= ((coordinate >> BRICK_BITS) & _AXIS) * _SPREAD[axis]
        within |= (coordinate & _BRICK) << (BRICK_BITS * axis)
    return (brick << (3 * BRICK_BITS)) | within


@kernel
def number_points(codes: Ints, table: Ints, known: Ints, count: int, is_adding: bool, numbers: Ints) -> int:
    """Fill the number of each code (n,); the number of known codes then.

    Parameters
    ----------
    table : hash table of numbers, -1 in empty slots; its size is a power of two, and at most half of it is filled.
    known : codes by their numbers, with space for new ones.
    count : number of known codes before.
    is_adding : True to number unknown codes from there on; otherwise they get -1.
    """
    mask = table.shape[0] - 1
    for i in range(codes.shape[0]):
        code = codes[i]
        slot = slot_of(code) & mask
        for _ in range(table.shape[0]):
            if table[slot] < 0 or known[table[slot]] == code:
                break
            slot = (slot + 1) & mask
        if table[slot] < 0 and is_adding:
            table[slot], known[count] = count, code
            count += 1
        numbers[i] = table[slot]
    return count


@kernel
def join(pairs: Ints, lowest: Ints) -> None:
    """Join pairs of points (n, 2) into components: `lowest` leads from each point to the lowest of its component."""
    for i in range(pairs.shape[0]):
        a, b = root(lowest, pairs[i, 0]), root(lowest, pairs[i, 1])
        lowest[max(a, b)] = min(a, b)


@routine
def root(lowest: Ints, i: int) -> int:
    """The lowest point of a component; the path to it is halved on the way."""
    for _ in range(lowest.shape[0]):
        if lowest[i] == i:
            break
        lowest[i] = lowest[lowest[i]]
        i = lowest[i]
    return i
