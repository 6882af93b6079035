"""python -m figures"""

import sys

from .page import main

main(sys.argv[1:])
