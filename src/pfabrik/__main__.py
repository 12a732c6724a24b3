"""``python -m pfabrik`` is the `pfabrik` command."""

from .cli import main

if __name__ == "__main__":
    main()
