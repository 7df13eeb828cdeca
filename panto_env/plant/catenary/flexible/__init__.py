"""Flexible catenary: tensioned wires, droppers that go slack, supports and steady arms."""
