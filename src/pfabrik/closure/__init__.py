"""The closure engine: the coordinates of all joints, loops closed to machine precision, for every mechanism."""
