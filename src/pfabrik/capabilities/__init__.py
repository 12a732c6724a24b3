"""What is asked of a machine beyond its kinematics, on the verbs and `pfabrik.kinematics` alone."""
