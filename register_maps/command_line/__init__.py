"""The command line that both programs share: a folder of commands, and checked parameters.

The two programs may not import each other, so that their common part stands with the language.
Only the modules of this folder may import click here; a codec or a log reader never loads it.
"""
