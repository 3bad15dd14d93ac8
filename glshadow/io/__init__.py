"""Reads files and objects of other libraries as scenes."""
