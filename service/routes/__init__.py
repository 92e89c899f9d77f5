"""One file a noun; each route reads its input, asks the agent, and words the answer."""
