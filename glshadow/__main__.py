"""python -m glshadow: the same as the command `glshadow`."""

from glshadow.cli import main

main()
