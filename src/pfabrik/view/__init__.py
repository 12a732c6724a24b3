"""Pictures. Needs the extra ``view``: ``pip install 'pfabrik[view]'``."""
