"""Three-span catenary of paper 2, in modal form."""
