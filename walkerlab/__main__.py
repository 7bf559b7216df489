"""Entry point of `python -m walkerlab`, which does the same as `walkerlab`."""

from walkerlab.views.cli.main import main

if __name__ == "__main__":
    main()
