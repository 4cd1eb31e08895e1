"""`python -m fitting.cli` is `mckibben`."""

from fitting.cli.main import main

if __name__ == "__main__":
    main()
