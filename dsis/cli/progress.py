"""The bar that long work shows on a terminal."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager


@contextmanager
def progress_bar(what: str) -> Iterator[Callable[[int, int, str], None]]:
    """Show a bar on a terminal once the work has taken two seconds."""
    from tqdm import tqdm

    with tqdm(desc=what, delay=2, disable=None, leave=False, dynamic_ncols=True) as bar:

        def tell(done: int, total: int, doing: str) -> None:
            bar.total = total
            bar.set_postfix_str(doing, refresh=False)
            bar.update(done - bar.n)

        yield tell
