"""All that touches Numba's and llvmlite's insides."""
