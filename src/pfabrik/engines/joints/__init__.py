"""The closure engine: solves for all joint coordinates of any mechanism, with loops closed to machine precision."""
