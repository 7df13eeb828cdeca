"""Records of measuring trains: the contact force along a line, judged, and held against a simulation."""
