"""Carries messages: LCM's multicast, TCP and the local socket, each behind Transport."""
