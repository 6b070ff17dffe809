"""The missing law: what a cause outside of the library looks like; see README.md one room up."""
