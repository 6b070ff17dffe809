"""How far the gap shrinks: held-out runs, bootstrap intervals, unmodelled remainder."""
