"""The HTTP API: who may call, the routes, the server."""
