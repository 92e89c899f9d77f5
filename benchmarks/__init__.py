"""How right, how fast and how robust it is: each benchmark prints a table and writes JSON."""

import core as core  # settles how many threads numpy may use, before numpy is loaded
