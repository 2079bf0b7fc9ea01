"""Apprentice: learn in which order an expert works on the regions of a part, and show a robot doing it."""
