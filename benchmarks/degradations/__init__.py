"""What a worse camera, a worse arm or a worse place makes of a view: pure functions of a view, a strength and a random generator."""
