"""`python -m walkerlab` is `walkerlab`."""

from walkerlab.views.cli.main import main

if __name__ == "__main__":
    main()
