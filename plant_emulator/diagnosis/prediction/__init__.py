"""The held-out gap: prediction, bootstrap intervals, unmodelled remainder."""
