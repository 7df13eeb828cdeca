"""How fast plants and environments are."""
