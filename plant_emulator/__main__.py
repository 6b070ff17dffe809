"""`python -m plant_emulator`."""

from plant_emulator.cli import main

if __name__ == "__main__":
    main()
