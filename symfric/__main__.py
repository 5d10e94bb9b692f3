"""Entry point of `symfric` and of `python -m symfric`.

`main` imports the command line itself, so that Ctrl-C during this import prints one sentence.
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
