"""What can be asked of the service: each function makes one request, and knows how to read its answer.

Nothing here sends: `RobotClient` and `AsyncRobotClient` do, each in its way. So both have the same methods, with the same arguments.
"""
