"""Solvers for legs in closed form in few unknowns: the platform's pose, proximal and redundant coordinates."""
