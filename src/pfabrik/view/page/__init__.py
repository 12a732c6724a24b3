"""A machine as one web page."""
