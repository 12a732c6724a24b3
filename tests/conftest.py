"""What all tests share: property tests that find the same examples in every run."""

from __future__ import annotations

import os

from hypothesis import settings

settings.register_profile("fixed", derandomize=True, deadline=None, database=None)
settings.register_profile("explore", deadline=None, max_examples=2000)
settings.load_profile(os.environ.get("PFABRIK_HYPOTHESIS", "fixed"))
