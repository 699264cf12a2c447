"""`python -m topometric` is `ptm`."""

from ._program import main

main()
