"""Clearance: how far links are from each other."""
