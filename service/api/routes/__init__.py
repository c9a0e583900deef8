"""The routes of the service, one module for each kind of thing that a client asks for."""
