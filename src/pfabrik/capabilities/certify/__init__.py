"""Proofs that every pose of a region is within all limits, or a pose that is not."""
