"""The experiments of the P-FABRIK paper, run again: accuracy, cost, and targets out of reach, next to what it printed.

What the paper prints, and the paths it follows, are data: `paper.toml`. Nothing else of the library uses this package.
"""
