"""python -m benchmarks answers: as python -m benchmarks answers."""

import sys

from benchmarks.answers.command import main

sys.exit(main(sys.argv[1:]))
