"""to_coco: masks of shadows and of objects as COCO annotations, in pairs."""

from __future__ import annotations

import json
from collections.abc import Mapping
from os import PathLike
from typing import Any

import numpy as np

from glshadow.core.setting import as_path, flag, refuse, shown
from glshadow.core.spaces import Bools
from glshadow.errors import SettingsError
from glshadow.files import replacing
from glshadow.training.masks import ShadowMasks
from glshadow.training.runs import as_text, run_lengths

OBJECT, SHADOW = 1, 2


def to_coco(
    images: Mapping[str, ShadowMasks],
    path: str | PathLike[str] | None = None,
    compressed: bool = True,
    objects: bool = True,
) -> dict[str, Any]:
    """Annotations of images in the format of COCO: instances of "shadow", and of "object" that cast them.

    An annotation has `segmentation` (run lengths down the columns, `size` is [height, width]), `area` and `bbox` [x, y, width, height] in
    pixels, `iscrowd` 0, and besides `name`, that of the node, and `association`: object and shadow of a node have the same number, as
    in data sets of instance shadow detection. Empty masks are left out.

    Parameters
    ----------
    images : mapping from file name to ShadowMasks
    path : optional
        Also write it there: .json.
    compressed : bool
        Run lengths as text, as pycocotools writes them; False: as lists of numbers.
    objects : bool
        Whether objects are annotated, too.

    Raises
    ------
    SettingsError
        For another mapping, or another suffix.
    GlshadowError
        If the file cannot be written.

    References
    ----------
    Lin et al. 2014, "Microsoft COCO: Common objects in context", ECCV; Wang, Hu, Wang, Heng, Fu 2020, "Instance shadow detection", CVPR,
    for the pairs.
    """
    if not isinstance(images, Mapping) or not all(
        isinstance(name, str) and isinstance(masks, ShadowMasks) for name, masks in images.items()
    ):
        raise refuse("images", "a mapping from file names to ShadowMasks, as shadow_masks gives them", images)
    compressed, objects = flag()("compressed", compressed), flag()("objects", objects)
    listed: list[dict[str, Any]] = []
    annotations: list[dict[str, Any]] = []
    pair = 0
    for number, (name, masks) in enumerate(images.items(), start=1):
        height, width = masks.shadows.shape[1:]
        listed.append({"id": number, "file_name": name, "width": width, "height": height})
        for k, node in enumerate(masks.nodes):
            pair += 1
            for category, mask in ((OBJECT, masks.objects[k]), (SHADOW, masks.shadows[k])):
                if mask.any() and (objects or category == SHADOW):
                    ids = {"id": len(annotations) + 1, "image_id": number, "category_id": category}
                    rest = {"iscrowd": 0, "name": node, "association": pair}
                    annotations.append(ids | _segmented(mask, compressed) | rest)
    categories = [{"id": OBJECT, "name": "object"}] * objects + [{"id": SHADOW, "name": "shadow"}]
    made: dict[str, Any] = {"images": listed, "annotations": annotations, "categories": categories}
    if path is not None:
        target = as_path("path", path)
        if target.suffix.lower() != ".json":
            raise SettingsError(f"path must end in .json, got {shown(target.name)}")
        with replacing(target) as part:
            part.write_text(json.dumps(made), encoding="utf-8")
    return made


def _segmented(mask: Bools, compressed: bool) -> dict[str, Any]:
    columns, rows = np.flatnonzero(mask.any(axis=0)), np.flatnonzero(mask.any(axis=1))
    left, top, right, bottom = (int(each) for each in (columns[0], rows[0], columns[-1], rows[-1]))
    lengths = run_lengths(mask)
    return {
        "segmentation": {"size": list(mask.shape), "counts": as_text(lengths) if compressed else lengths},
        "area": int(mask.sum()),
        "bbox": [left, top, right - left + 1, bottom - top + 1],
    }
