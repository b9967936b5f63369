"""``python -m mapquilt``."""

from mapquilt.cli import main

if __name__ == "__main__":
    main()
