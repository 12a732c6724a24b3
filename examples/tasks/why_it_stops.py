"""Why it stops: a target out of reach, and what holds the machine back.

For anybody whose machine did not go where it was sent. You learn to read the answer: how far it is from the target,
which limits are in the way and by how much, how much room there is elsewhere, and what was tried.
"""

# A hexapod is asked to go up and sideways by more than its struts allow.
from collections import Counter

import pfabrik as pf

machine = pf.load("stewart")
target = pf.pose([40, 10, 290], rpy=[0, 10, 0], degrees=True)
answer = pf.solve_ik(machine, target)
print(answer.status.name)

# `PROJECTED` means: the target cannot be reached, and this is the nearest pose that can. Its loops are closed and every
# limit is kept, so it is safe to send it to the machine. If you prefer to refuse such a target, test `if answer:`,
# which is true for reached targets only.
print(f"{answer.position_error:.2f} mm and {answer.rotation_error:.3f} rad from the target")
print("position", answer.pose[:3, 3].round(2))
pf.plot(answer).figure.savefig("held.png", dpi=110)

# ## What holds it back
#
# In a sentence:
print(answer.reason)

# One by one: `active_limits` lists the limits that stop it, the most restrictive first. The multiplier is what giving
# way would bring: here a strut that is 1 mm longer brings the answer about 1 mm nearer.
for limit in answer.active_limits:
    print(f"{limit.joint} at its {limit.bound}, {limit.value:.1f} mm: {limit.multiplier:.2f} mm per mm")

# Try it: give this strut 2 mm more.
longer = machine.with_limits({answer.active_limits[0].joint: (155, 282)})
better = pf.solve_ik(longer, target)
gain = answer.position_error - better.position_error
print(f"{better.position_error:.2f} mm from the target, nearer by {gain:.2f} mm")
print(better.reason)

# ## Keep the position instead
#
# By default the answer has the target's orientation and gives up position. It can be the other way round, or both may
# change. Here the platform is asked to lean by more than its joints allow.
steep = pf.pose([20, 5, 200], rpy=[0, 50, 0], degrees=True)
for hold in ("orientation", "position", None):
    each = pf.solve_ik(machine, steep, options=pf.Options(hold=hold))
    print(f"hold={hold!r}: {each.position_error:.2f} mm, {each.rotation_error:.3f} rad, held {each.held}")

# `held` says what the answer has. Where no pose has what should be held, everything gives way and `held` is None.

# ## How much room is left
#
# Within reach, margins say how far each limit is off: 1 in the middle of a range, 0 on the limit.
here = pf.solve_ik(machine, [20, 5, 200])
for (joint, bound), margin in sorted(pf.margins(here).items(), key=lambda item: item[1])[:3]:
    print(f"{joint} {bound}: {margin:.2f}")

# ... and `travel` how far it can go from there, until what stops it.
for each in pf.travel(here, along=[(1, 0, 0), (0, 0, 1)]):
    print(each.direction, f"{each.distance:.1f} mm,", each.why)

# ## No limit, and still out of reach
#
# Sometimes no joint is at a limit. The reason then names the geometry. Here it is a 5-bar without limits: its links are
# stretched out.
five_bar = pf.load("five_bar").without_limits()
stretched = pf.solve_ik(five_bar, [0, 0, 300])
print(stretched.active_limits[0].bound, "|", stretched.reason)

# And here it is the machine's kind: a 5-bar moves in the plane x = 0 and cannot leave it.
print(pf.solve_ik(five_bar, [20, 0, 180]).reason)

# ## What was tried
#
# `search_log` repeats the search and lists every attempt: from which start, how many steps, where it ended. Read it if
# an answer looks too far away to you. `print(log)` shows all attempts, one a line; here they are counted. That many
# starts end at the same distance is a good sign.
log = pf.search_log(machine, target)
for (phase, ending), count in Counter((attempt.phase, attempt.ending) for attempt in log.attempts).items():
    print(f"{count:3d} x {phase}: {ending}")
print("answered by:", log.answered_by)
print("exceeded most by the target itself:", *log.blocked_by[:2])
