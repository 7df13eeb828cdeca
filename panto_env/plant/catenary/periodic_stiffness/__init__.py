"""Paper 3's catenary: a massless spring."""
