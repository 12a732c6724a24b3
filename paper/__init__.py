"""The P-FABRIK paper beside the library: its experiments run again, next to what it printed, and its yardstick.

`python -m paper` runs the experiments; what the paper prints, and the paths it follows, are data: `paper.toml`.
`paper.geometric` is its geometric approach: closed forms of three topologies. Both stand on the public names of pfabrik
alone, and are no part of its wheel.
"""
