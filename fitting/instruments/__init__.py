"""Instruments that err: what errors within their accuracy can make of the rows that a fit makes small."""
