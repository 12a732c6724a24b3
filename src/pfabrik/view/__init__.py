"""Pictures, which need the extra ``plot``, and the viewer in the browser, which needs the extra ``view``."""
