"""Identified muscles: raw data, model, posterior and verdict in one folder that can be sent to others."""
