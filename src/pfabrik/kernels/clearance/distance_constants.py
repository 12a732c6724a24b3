"""Constants of the distance of convex links."""

# Distance (`convex`, `segments`, `solids`, `least_clearance`)

MOST_SIMPLICES, MOST_STALLED = 100, 8
"""Most simplices, of two polyhedra some ten are needed, beside a rim some thirty; and most that are no nearer."""

ROUNDING = 4e-16
"""Rounding of a coordinate, relative to its size: a gap as small as this says nothing."""

MOST_CORNERS = 256
"""Most corners of the polytope around the origin; between two rims some hundred are needed."""

FLAT, CLOSE = 1e-14, 1e-13
"""Depth below which a new corner is none, and error of the depth, relative to the size of the polytope."""

TOUCHING, NEAR = 1e-14, 1e-7
"""Distances relative to the size of coordinates up to which two cores touch, so that their direction is rounding; and
up to which they may touch if one has a rim: there the polytope says how far they are apart, too little by a share of it
beside a sharp edge. Searches keep links farther apart than that."""

PARALLEL = 1e-9
"""Sine of the angle below which two axes count as parallel where they touch."""

ALONG_AXIS = 1e-14
"""Sine of the angle to the axis of a disc below which a direction counts as along it."""
