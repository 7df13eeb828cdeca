"""Sensors of a train."""
