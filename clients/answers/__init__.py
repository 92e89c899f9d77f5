"""What the service answers to `clients.calls`, as numpy and plain types: a file a noun."""
