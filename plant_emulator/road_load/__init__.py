"""Identification of a truck's road load and gear efficiency from logs of a road."""
