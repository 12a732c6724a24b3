"""Forces, stiffness and accuracy: what follows from a machine's first order, at any configuration of an answer."""
