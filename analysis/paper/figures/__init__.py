"""The pictures of the page: the part of it that touches matplotlib."""
