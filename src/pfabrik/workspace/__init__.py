"""How big a workspace is, what bounds it, and where it is singular."""
