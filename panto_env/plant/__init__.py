"""The physics: knows nothing of Gymnasium, rewards or policies."""
