"""LegBounds of every limit over cells of poses, and the subdivision that proves or encloses with them."""
