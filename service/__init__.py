"""The HTTP service around the method and its memory."""
