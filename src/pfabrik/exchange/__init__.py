"""Machines from and for others: robot files in and out, code for controllers."""
