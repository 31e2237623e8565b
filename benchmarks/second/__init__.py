"""A second simulator of recordings with hidden physics, written apart from the first.

It shares no code with dsis, with the planter or with whoever wrote them: a contract of words
alone says what each effect is, and where the words leave something open it is read in another way
than the project reads it (`vocabulary`). A diagnosis that has learnt the habits of one simulator
stumbles here. An oracle that knows the effect and its template measures how far each stands out.

Signals are in DN above black, times in seconds, lengths in pixels unless said. A case and an
effect are plain mappings: an effect holds its "kind", the contract's parameters and, under other
keys, how this sensor realises it. Every random draw has a stream of its own name, so that leaving
one effect out leaves all others as they were.
"""
