"""From a sequence of regions to a simulated robot doing it: strokes, joint paths, timing, force control (Sec. VI)."""
