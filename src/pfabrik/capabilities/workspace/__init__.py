"""Workspaces: their size, the limits that bound them, and their singularities."""
