"""What travels over HTTP: requests and answers, with shapes, units and frames on every field."""
