"""The console: pages for people, made on the server from what the agent and the memory answer."""
