"""Features of transitions, costs of sequences, and the searches over all orders of a tool's regions (Eq. 1-3, Sec. IV)."""
