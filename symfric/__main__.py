"""Entry point of `symfric` and of `python -m symfric`.

It imports the command line inside `main`, so that Ctrl-C during that import ends in a sentence.
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
