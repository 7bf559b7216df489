"""`python -m walkerlab` is `walkerlab`."""

from walkerlab.cli.main import main

if __name__ == "__main__":
    main()
