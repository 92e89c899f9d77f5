"""The HTTP service around the method and its memory."""

import core as core  # settles how many threads numpy may use, before numpy is loaded
