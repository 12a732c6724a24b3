"""TDS, the topological decomposition: a mechanism falls apart into sub-chains, and these become arrays."""
