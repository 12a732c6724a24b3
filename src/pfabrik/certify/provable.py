"""The mechanisms of which something can be proved."""

from __future__ import annotations

from ..description.mechanism import Mechanism
from ..errors import UnsupportedMechanism


def require_no_clearance(mechanism: Mechanism, doing: str) -> None:
    """Raise UnsupportedMechanism if a mechanism has a clearance: there are no bounds of distances over regions."""
    if mechanism.clearance is not None:
        reason = "its clearance is no part of a proof: ask for `mechanism.with_clearance(None)`"
        raise UnsupportedMechanism(mechanism.name, [reason], doing)
