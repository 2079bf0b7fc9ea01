"""Measurements anybody can repeat: `apprentice bench NAME` runs them, prints each figure beside its bar, and says which bars are missed.

A bench is a module of this folder with `measure(options)`, which yields figures as they become known.
"""
