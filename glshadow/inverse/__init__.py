"""Lights from their shadows."""
