"""The bench's equations after the thesis; README.md beside this file is their nomenclature."""
