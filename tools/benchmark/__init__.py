"""What `tools/bench.py` measures: our code and its peers, in turns."""
