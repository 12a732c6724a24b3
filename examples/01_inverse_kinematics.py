"""Inverse kinematics of a Stewart platform: one target within reach, one beyond it."""

import pfabrik as pf

mechanism = pf.load("stewart")

near = pf.solve_ik(mechanism, pf.pose([10, 0, 190], rpy=[0, 0.1, 0]))
print(near.status)
for name, length in zip(mechanism.actuator_names, near.actuators, strict=True):
    print(f"  strut {name}: {length:.3f} {mechanism.length_unit}")

# A target beyond the struts' stroke is no error: the answer is a feasible pose near it, and says what holds it back.
far = pf.solve_ik(mechanism, pf.pose([0, 0, 300]))
print(f"{far.status}: {far.position_error:.1f} {mechanism.length_unit} from the target")
for limit in far.active_limits:
    print(f"  {limit.joint} at its {limit.bound}: {limit.value:.3f}")
