"""The command `symfric`: what stands before the first import that takes time.

It lies outside of the package, which imports CasADi and NumPy before any of its rooms: Ctrl-C in
that second ends in a sentence, too.
"""

import sys


def main() -> int:
    """Run the command line and return its exit status."""
    try:
        from symfric.cli import main as run  # noqa: PLC0415  (this is the import that takes time)

        return run()
    except KeyboardInterrupt:
        sys.stderr.write("symfric: interrupted\n")
        return 130


if __name__ == "__main__":
    sys.exit(main())
