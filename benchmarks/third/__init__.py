"""A third simulator of recordings with hidden physics, by another hand than the first two.

It was written from a contract of words and docs/effects.md alone, by a hand that had seen no line
of dsis, of the planter or of the second simulator: no file here but the judge's summary imports
one of theirs. Every effect is there by the law that the words give or by one beside it
("neighbouring": a wave with a harmonic, a lens off its axis, jumps that are no equal shares), and
a tenth of the recordings holds physics that is on no list.

Signals are in DN above black, times in seconds, lengths in pixels unless said; stacks are
(frame, row, column). The z of an effect is the root of the expected deviance, twice the log
likelihood ratio, of somebody who knows the family of a random pattern, or a fixed pattern itself,
with the base numbers free where they can take its place. For small effects it is the size over
its standard error.

One stream of chance runs through a whole deck of cases: they are drawn and written in order.
"""
