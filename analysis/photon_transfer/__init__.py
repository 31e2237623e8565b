"""Photon transfer."""
