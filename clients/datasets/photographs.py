"""Plain folders of images, without depth and cameras: CATEGORY/INSTANCE/*.jpg. They tell known from novel, and have no pose."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

from clients.datasets import folders
from clients.datasets.images import is_image, read_rgb
from core.errors import InvalidInput
from core.views import View


class PhotographReader(folders.Reader):
    """Reads images alone."""

    def read(self, sequence: folders.Sequence, indices: Sequence[int], masks: bool) -> list[View]:
        """See `folders.Reader`."""
        return [folders.view_of(image, read_rgb(image)) for image in (sequence.images[index] for index in indices)]

    def files(self, sequence: folders.Sequence) -> list[Path]:
        """See `folders.Reader`."""
        return list(sequence.images)


def find_sequences(root: Path) -> list[folders.Sequence]:
    """Every folder that holds images, `root` or below it: its category is the folder around it. Raises InvalidInput where there is none."""
    found = []
    for place, files in sorted(folders.folders_below(root)):
        folder = place.resolve()
        images = tuple(folder / file for file in sorted(files) if is_image(Path(file)))
        if images:
            found.append(folders.Sequence(folder, folder.parent.name, folder.name, images, None, (), PhotographReader()))
    if not found:
        raise InvalidInput("data", f"no image in or below {root}; expected CATEGORY/INSTANCE/*.jpg")
    return found


OFFERS: Mapping[str, folders.Format] = {"images": find_sequences}
