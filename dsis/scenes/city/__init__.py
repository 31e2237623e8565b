"""City: a panorama over a dense city, traced without chance."""

from dsis.scenes.city.panorama import prepared

__all__ = ["prepared"]
