"""Capabilities beyond kinematics, on the verbs and `pfabrik.kinematics` alone."""
