"""Several machines as one: bodies of the same name are one body."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Sequence

from numpy.typing import ArrayLike

from ...common.checks import require_type
from ...errors import InvalidArgument, UnknownName
from ...machine.description.form_faults import shown
from ...machine.description.joints import Joint
from ...machine.description.mechanism import Mechanism, checked_mechanism


def join(
    *machines: Mechanism,
    joints: Iterable[Joint] = (),
    end_effector: str,
    reference_point: ArrayLike | None = None,
    task: Sequence[str] | None = None,
    name: str | None = None,
) -> Mechanism:
    """Machines as one mechanism, on the base of the first.

    Bodies of one name are one body: a machine stands on the base of the first where its own has that name, or on the
    body of another machine that `Mechanism.at` calls its base. What else holds them together are `joints`.

    Parameters
    ----------
    *machines : Mechanism
        The machines, where they are and with names of their own: see `Mechanism.at`.
    joints : iterable of Joint, optional
        Joints between their bodies, or new ones, at home, in base coordinates.
    end_effector : str
        A body or a joint.
    reference_point : array (3,), optional
        The point of the end effector that targets place [length]. Default: that of the machine whose it is.
    task : sequence of str, optional
        As in `Mechanism`. Default: that of the machine whose end effector it is, else all.
    name : str, optional
        Default: the names of the machines.

    Raises
    ------
    InvalidArgument
        No machine, other units of length, or a body that two machines have and that is the base of neither.
    UnknownName
        A base that is no body of another machine.
    InvalidMechanism
        What they make is none, with every fault.
    """
    if not machines:
        raise InvalidArgument("machines", "none", "one or more mechanisms")
    first = checked_mechanism(machines[0])
    own = [require_type("joints", each, Joint, "joints") for each in joints]
    for machine in machines:
        if checked_mechanism(machine).length_unit != first.length_unit:
            raise InvalidArgument("machines", f"lengths in {machine.length_unit} and {first.length_unit}", "one unit")
    carriers = {body for machine in machines for body in machine.bodies if body != machine.base} | {first.base}
    for machine in machines:
        if machine.base not in carriers:
            raise UnknownName(f"body of another machine under '{machine.name}'", machine.base, sorted(carriers))
    bases = {machine.base for machine in machines}
    counts = Counter(body for machine in machines for body in machine.bodies if body not in bases)
    twice = [body for body, count in counts.items() if count > 1]
    if twice:
        raise InvalidArgument(
            "machines", f"two with a body {shown(twice[0])}", "names of their own: machine.at(pose, prefix='L_')"
        )
    owner = next((each for each in machines if each.end_effector == end_effector), None)
    if owner is not None and reference_point is None and not owner.end_effector_is_joint:
        reference_point = owner.reference_point
    clearances = [machine.clearance for machine in machines if machine.clearance is not None]
    return Mechanism(
        " and ".join(machine.name for machine in machines) if name is None else name,
        [*own, *(joint for machine in machines for joint in machine.joints)],
        end_effector,
        reference_point,
        first.base,
        first.length_unit,
        first.angle_unit,
        owner.task if owner is not None and task is None else task,
        [shape for machine in machines for shape in machine.shapes],
        [pair for machine in machines for pair in machine.ignore],
        max(clearances, default=None),
        [mass for machine in machines for mass in machine.masses],
    )
