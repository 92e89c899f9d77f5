"""Everything between the service and a robot, a data set or a terminal."""
