"""``python -m radioslam``."""

from radioslam.cli import main

main()
