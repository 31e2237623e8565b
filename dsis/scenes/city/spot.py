"""The spot of a surface that a ray has met: numbers in one array, filled in step by step."""

AT, NORMAL, COLOUR = 0, 3, 6  # three numbers each: metres; unit vector; diffuse reflectance
GLASS, POLISH, BARE = 9, 10, 11  # share of glass, of polish; what they mirror head-on
SPREAD = 12  # 1 - cosine over which a mirrored sun is spread
LIT = 13  # share that nothing on the surface itself shades
WRAP = 14  # how far around its edge the sun still lights: leaves let light through
DISTANCE, WIDE = 15, 16  # from the eye; of a part of a pixel there; metres
NUMBERS = 17

Vec = tuple[float, float, float]
