"""Mutation testing: do the tests notice when a formula is changed?"""
