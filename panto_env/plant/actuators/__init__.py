"""Actuators on the pantograph."""
