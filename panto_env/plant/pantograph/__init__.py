"""Pantograph: a chain of lumped masses."""
