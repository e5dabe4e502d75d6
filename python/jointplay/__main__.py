"""`python -m jointplay`."""

from jointplay.cli import main

if __name__ == "__main__":
    main()
