"""Everything between the service and a robot, a data set or a terminal."""

import core as core  # settles how many threads numpy may use, before numpy is loaded
