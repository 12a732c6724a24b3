"""What is no machine for a closed form."""

from __future__ import annotations

from collections.abc import Sequence

from pfabrik.errors import PfabrikError


class NoClosedForm(PfabrikError, ValueError):
    """A valid mechanism whose topology has no closed form here; the library may solve it all the same.

    Attributes
    ----------
    mechanism : its name.
    sub_chains : its sub-chains, as `decompose` prints them.
    reason : what it lacks.
    topologies : which topologies have a closed form.
    """

    def __init__(self, mechanism: str, sub_chains: Sequence[str], reason: str, topologies: Sequence[str]) -> None:
        self.mechanism = mechanism
        self.sub_chains = tuple(sub_chains)
        self.reason = reason
        self.topologies = tuple(topologies)
        super().__init__(
            f"'{mechanism}' has no closed form: found sub-chains {'; '.join(self.sub_chains)} ({reason}); "
            f"expected only {', or only '.join(self.topologies)}"
        )
