"""One connection to a run: its clock, requests, callbacks and end."""
