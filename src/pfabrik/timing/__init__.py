"""How fast a path may be followed, and how fast a platform may move."""
