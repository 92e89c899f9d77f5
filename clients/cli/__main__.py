"""`python -m clients.cli`: the `onelook` command without an installed script."""

from clients.cli import main

main()
