"""Image files: photos of any format by OpenImageIO, float maps with named channels as OpenEXR."""

import struct
from pathlib import Path

import numpy as np
import OpenEXR
import OpenImageIO as oiio
import tifffile
from jaxtyping import Float, Float16, Float32, UInt16
from numpy import ndarray as Array
from PIL import Image
from scipy.ndimage import map_coordinates
from scipy.sparse import csr_array

from dav_gswt.errors import InputError, summarize_error
from dav_gswt.files import UNREADABLE, atomic_file
from dav_gswt.images.camera_formats import DECODERS
from dav_gswt.images.file_kinds import detect_kind

AT_ONCE = 2_000_000  # values that are averaged at a time
MAX_PIXELS = 200_000_000  # of a photo: more is a broken header, or more than two cores should work on
GDAL_NODATA = 42113  # tag of a TIFF
PREVIEW = "colours"  # in an EXR's header: its R, G and B are other channels in colours
RAMP = (  # colours of a preview from low to high, linear light: as viridis of Matplotlib has them
    (0.058, 0.000, 0.089),
    (0.041, 0.084, 0.258),
    (0.015, 0.276, 0.263),
    (0.112, 0.584, 0.121),
    (0.984, 0.799, 0.019),
)
PNG_END = b"\0\0\0\0IEND\xaeB`\x82"  # its last chunk
IF_FULL = "if the disk is full, free some space, then run the same again"


def read_size(path: Path | str) -> tuple[int, int]:
    """Width and height with the EXIF orientation applied, from the header alone."""
    width, height, orientation = read_stored_size(path)
    return (height, width) if orientation >= 5 else (width, height)


def read_stored_size(path: Path | str) -> tuple[int, int, int]:
    """Width and height as stored, and EXIF's orientation, from the header alone; HEIC and raw count as upright."""
    if decoder := DECODERS.get(detect_kind(Path(path))):  # OpenImageIO does not read it
        return *_check_size(path, *decoder.read_size(Path(path))), 1
    file, spec = _open_image(path)
    file.close()
    return spec.width, spec.height, _read_orientation(spec)


def read_photo(path: Path | str) -> Float32[Array, "h w 3"]:
    """A photo of any bit depth as sRGB-encoded colours in [0, 1], upright by its EXIF orientation, without alpha.

    Grey becomes three equal channels. Raises: InputError: missing, not an image, cut short, or too large.
    """
    return _read_colours(path)[0]


def read_shrunk_photo(path: Path | str, longest: int) -> Float32[Array, "h w 3"]:
    """`read_photo` shrunk to at most `longest` pixels along the longer side, by area means.

    A JPEG is decoded at a half, a quarter or an eighth of its size where that is enough, in a fifth of the time and
    less than half of the memory: libjpeg leaves out the high frequencies of its blocks.
    """
    width, height, turn = read_stored_size(path)
    small = fit_size(width, height, longest)
    try:
        with Image.open(path) as file:
            decodes_reduced = file.format in ("JPEG", "MPO") and file.mode in ("RGB", "L")
            reduced = decodes_reduced and file.draft(file.mode, small) and file.size != (width, height)
            pixels = np.asarray(file.convert("RGB"), np.float32) / 255 if reduced else None
    except (Image.DecompressionBombError, *UNREADABLE):  # another format, or a damaged file, which is named below
        pixels = None
    if pixels is None:
        return shrink_to(read_photo(path), longest)
    return np.ascontiguousarray(_apply_orientation(shrink_image(pixels, *small), turn))


def read_photo_and_alpha(path: Path | str) -> tuple[Float32[Array, "h w 3"], Float32[Array, "h w"]]:
    """A photo as `read_photo` returns it, and its alpha: 0 where it is masked; 1 where the file has none."""
    pixels, alpha = _read_colours(path)
    return pixels, np.ones(pixels.shape[:2], np.float32) if alpha is None else alpha


def _read_colours(path: Path | str) -> tuple[Float32[Array, "h w 3"], Float32[Array, "h w"] | None]:
    """Colours, and alpha where the file has one. Photos may have 50 million pixels: what can be done in place is."""
    if decoder := DECODERS.get(detect_kind(Path(path))):  # OpenImageIO does not read it
        _check_size(path, *decoder.read_size(Path(path)))
        pixels = decoder.read_pixels(Path(path))
        return np.ascontiguousarray(pixels[..., :3]), pixels[..., 3].copy() if pixels.shape[2] == 4 else None
    file, spec = _open_image(path)
    # alpha is read along: reading only some of the channels is slower in many formats
    pixels = _read_pixels(file, path, min(spec.nchannels, 4))
    alpha = pixels[..., spec.alpha_channel] if 0 <= spec.alpha_channel < pixels.shape[2] else None
    pixels = pixels[..., :3] if pixels.shape[2] >= 3 else np.repeat(pixels[..., :1], 3, axis=2)
    if not np.isfinite(pixels).all():
        raise InputError(f"{path}: has pixels that are not finite; export it as 8 or 16 bit")
    for part in (pixels, alpha):
        if part is not None:
            np.clip(part, 0, 1, out=part)
    turn = _read_orientation(spec)
    upright = np.ascontiguousarray(_apply_orientation(pixels, turn))
    return upright, None if alpha is None else np.ascontiguousarray(_apply_orientation(alpha, turn))


def read_channel(path: Path | str) -> Float32[Array, "h w"]:
    """The first channel, upright, integers scaled to [0, 1]; neither clipped nor checked for finite values.

    Raises: InputError: missing, not an image, cut short, too large, or integers with a sign, which have no white.
    """
    file, spec = _open_image(path)
    if str(spec.format).startswith("int"):
        file.close()
        raise InputError(f"{path}: its integers have a sign ({spec.format}); save it as float32, or as unsigned 16 bit")
    return np.ascontiguousarray(_apply_orientation(_read_pixels(file, path, 1)[..., 0], _read_orientation(spec)))


def read_no_data(path: Path | str) -> float | None:
    """The value of pixels without data that a TIFF names (GDAL's tag), scaled as `read_channel` scales pixels.

    None: it names none, or the file is no TIFF. Any file that `read_channel` reads may be given.
    """
    try:
        with tifffile.TiffFile(path) as file:
            page = file.pages.first
            value, dtype = float(page.tags[GDAL_NODATA].value), page.dtype
    except (*UNREADABLE, tifffile.TiffFileError, struct.error):
        return None
    return value / np.iinfo(dtype).max if dtype is not None and dtype.kind == "u" else value


def write_png(path: Path | str, image: Float[Array, "h w c"]) -> None:
    """Write a PNG of 8 bits a channel, atomically; values are clipped to [0, 1].

    A fourth channel is alpha, not premultiplied.
    """
    pixels = np.ascontiguousarray(np.rint(np.clip(image, 0, 1) * 255).astype(np.uint8))
    spec = oiio.ImageSpec(pixels.shape[1], pixels.shape[0], pixels.shape[2], oiio.UINT8)
    spec["oiio:UnassociatedAlpha"] = 1
    spec["oiio:ColorSpace"] = "srgb_rec709_scene"
    _write_pixels(path, spec, pixels)


def write_grey16(path: Path | str, values: UInt16[Array, "h w"]) -> None:
    """Write a grey PNG of 16 bits whose values are no colours, atomically."""
    spec = oiio.ImageSpec(values.shape[1], values.shape[0], 1, oiio.UINT16)
    _write_pixels(path, spec, np.ascontiguousarray(values)[..., None])


def _write_pixels(path: Path | str, spec: oiio.ImageSpec, pixels: Array) -> None:
    oiio.attribute("threads", 1)
    spec["png:compressionLevel"] = 2  # a third of the time of the default, 6; files are 3 % smaller to 4 % larger
    with atomic_file(path) as part:
        file = oiio.ImageOutput.create(str(part))  # by the ending, which need not be .png
        if file is None:
            raise ValueError(f"{path}: {summarize_error(oiio.geterror())}")
        done = file.open(str(part), spec) and file.write_image(pixels)
        trouble = "" if done else file.geterror()
        whole = file.close() and (part.suffix.lower() != ".png" or part.read_bytes().endswith(PNG_END))
        if not (done and whole):  # OpenImageIO does not notice that a disk is full
            trouble = trouble or file.geterror() or "cut short"
            raise OSError(f"{path}: not written ({summarize_error(trouble)}); {IF_FULL}")


def fit_size(width: int, height: int, longest: int) -> tuple[int, int]:
    """Width and height of a picture shrunk to at most `longest` pixels along its longer side, never enlarged."""
    share = min(1.0, longest / max(width, height))
    return max(1, round(width * share)), max(1, round(height * share))


def shrink_to(image: Float32[Array, "h w c"], longest: int) -> Float32[Array, "height width c"]:
    """The image shrunk as `fit_size` says."""
    return shrink_image(image, *fit_size(image.shape[1], image.shape[0], longest))


def shrink_image(image: Float32[Array, "h w c"], width: int, height: int) -> Float32[Array, "height width c"]:
    """The image on a coarser grid: each pixel is the exact mean over its area, of the encoded values.

    Exact for any ratio (a box filter sampled at pixel centres is up to 7 % off for ratios like 10 to 4).
    Raises: ValueError: the image would be enlarged, or have no pixels.
    """
    if not (1 <= width <= image.shape[1] and 1 <= height <= image.shape[0]):
        raise ValueError(f"an image of {image.shape[1]} x {image.shape[0]} does not shrink to {width} x {height}")
    return np.ascontiguousarray(_average_axis(_average_axis(image, height, 0), width, 1), np.float32)


def write_exr(path: Path | str, channels: dict[str, Array], header: dict[str, str] | None = None) -> None:
    """Write named float maps of one size, with texts in the header.

    Write numbers as text by repr(): EXR's own numbers have single precision.
    """
    write_exr_parts(path, {"": (channels, header or {})})


def read_exr(path: Path | str) -> tuple[dict[str, Array], dict[str, str]]:
    """Channels by name and the header's texts, of a file with one part. Raises: InputError: not readable."""
    return next(iter(read_exr_parts(path).values()))


def colour_values(values: Float32[Array, "h w"]) -> tuple[Float16[Array, "h w 3"], float, float]:
    """A map in colours, linear light, and the values of the darkest and the brightest one; grey where it is no number.

    The range leaves out the outermost hundredths, so that one odd pixel does not hide the others.
    """
    known = np.isfinite(values)
    low, high = np.percentile(values[known], [1, 99]).tolist() if known.any() else (0.0, 0.0)
    share = np.clip((np.where(known, values, low) - low) / ((high - low) or 1.0), 0, 1)
    stops = np.linspace(0, 1, len(RAMP))
    shown = np.stack([np.interp(share, stops, channel) for channel in np.array(RAMP).T], -1)
    return np.where(known[..., None], shown, 0.2).astype(np.float16), low, high


def enlarge_map(values: Float32[Array, "h w"], width: int, height: int) -> Float32[Array, "h2 w2"]:
    """A map on a finer grid over the same area: linear between cell centres, constant beyond the outermost."""
    rows, columns = ((np.arange(n) + 0.5) * old / n - 0.5 for n, old in zip((height, width), values.shape, strict=True))
    at = np.stack(np.meshgrid(rows, columns, indexing="ij"))
    return map_coordinates(values, at, order=1, mode="nearest")


def write_exr_parts(path: Path | str, parts: dict[str, tuple[dict[str, Array], dict[str, str]]]) -> None:
    """Write a file of several parts, each with its own channels, size and header, by name.

    Viewers of pictures know channels of colours alone. A part without any gets R, G and B, its first channel in
    colours, and a text `colours` in the header that says so; they are no data, and `read_exr_parts` leaves them out.
    """
    written = []
    # Parts of one file must agree on the display window, whatever their own sizes are.
    shapes = [np.shape(values) for channels, _ in parts.values() for values in channels.values()]
    last = np.array([max(w for _, w in shapes) - 1, max(h for h, _ in shapes) - 1], np.int32)
    window = {"displayWindow": (np.zeros(2, np.int32), last)}
    for name, (channels, header) in parts.items():
        # The library fills the dicts it is given with its own objects, hence the copies.
        own = {k: np.array(v, np.float32) for k, v in channels.items()}
        texts = {k: str(v) for k, v in header.items()}
        if not {"R", "G", "B", "Y"} & set(own):
            first = next(iter(own))
            shown, low, high = colour_values(own[first])
            own |= {name: np.ascontiguousarray(shown[..., k]) for k, name in enumerate("RGB")}
            texts |= {PREVIEW: f"R, G, B: {first} from {low:.6g}, dark, to {high:.6g}, bright; other channels are data"}
        fixed = {"compression": OpenEXR.ZIP_COMPRESSION, "type": OpenEXR.scanlineimage}
        written.append(OpenEXR.Part(texts | fixed | window, own, name))
    with atomic_file(path) as part:
        try:
            OpenEXR.File(written).write(str(part))
        except RuntimeError as error:
            raise OSError(f"{path}: not written ({summarize_error(error)}); {IF_FULL}") from error


def read_exr_parts(path: Path | str) -> dict[str, tuple[dict[str, Array], dict[str, str]]]:
    """The parts of a file by name: channels, and the header's texts. Raises: InputError: not readable, or too large."""
    if not Path(path).is_file():
        raise InputError(f"{path}: there is no such file")
    try:
        with OpenEXR.File(str(path), header_only=True) as file:
            announced = len(file.parts)
            for part in file.parts:
                low, high = (np.asarray(corner, np.int64) for corner in part.header["dataWindow"])
                if np.prod(high - low + 1) > MAX_PIXELS:
                    raise ValueError(f"a part of {' x '.join(map(str, high - low + 1))} pixels is more than is read")
        with OpenEXR.File(str(path), separate_channels=True) as file:
            if len(file.parts) < announced:  # the library drops damaged parts with a mere warning
                raise ValueError("damaged or cut short")
            return {part.name(): _read_part(part) for part in file.parts}
    except (RuntimeError, ValueError, TypeError, OSError) as error:
        raise InputError(f"{path}: not readable as EXR ({summarize_error(error)})") from error


def _read_part(part) -> tuple[dict[str, Array], dict[str, str]]:
    texts = {k: v for k, v in part.header.items() if isinstance(v, str) and k != "name"}
    shown = ("R", "G", "B") if texts.pop(PREVIEW, None) is not None else ()
    channels = {name: np.array(channel.pixels) for name, channel in part.channels.items() if name not in shown}
    return channels, texts


def _open_image(path: Path | str):
    """An open image and its header. Raises: InputError: missing, not an image, or too large."""
    oiio.attribute("threads", 1)  # a job has as many threads as its rule says; decoding needs one
    config = oiio.ImageSpec()
    config["oiio:UnassociatedAlpha"] = 1
    if not Path(path).is_file():
        raise InputError(f"{path}: there is no such file")
    file = oiio.ImageInput.open(str(path), config)
    if file is None:
        raise InputError(f"{path}: not readable as an image ({summarize_error(oiio.geterror())}); remove or replace it")
    spec = file.spec()
    if spec.width < 1 or spec.height < 1 or spec.nchannels < 1 or spec.depth > 1 or spec.deep:
        raise InputError(f"{path}: holds no flat picture; remove or replace it")
    _check_size(path, spec.width, spec.height)
    return file, spec


def _check_size(path: Path | str, width: int, height: int) -> tuple[int, int]:
    if width * height > MAX_PIXELS:
        most = MAX_PIXELS // 10**6
        raise InputError(f"{path}: {width} x {height} pixels; at most {most} megapixels are read: shrink it")
    return width, height


def _read_pixels(file, path: Path | str, channels: int) -> Float32[Array, "h w c"]:
    """The first channels of an open image as they are stored. Closes the image."""
    spec = file.spec()
    try:
        pixels = file.read_image(0, 0, 0, channels, oiio.FLOAT)
        trouble = file.geterror() if file.has_error else ""
    finally:
        file.close()
    if pixels is None or trouble:
        reason = summarize_error(str(trouble).replace(f' ("{path}")', ""))  # it is named already
        raise InputError(f"{path}: damaged or cut short ({reason}); copy it again or remove it")
    return np.asarray(pixels, np.float32).reshape(spec.height, spec.width, -1)


def _read_orientation(spec) -> int:
    value = spec.getattribute("Orientation")
    return value if isinstance(value, int) and 1 <= value <= 8 else 1


def _apply_orientation(pixels: Array, orientation: int) -> Array:
    """Undo an EXIF orientation: 5 to 8 are transposed, then rows and columns are mirrored."""
    if orientation >= 5:
        pixels = pixels.swapaxes(0, 1)
    if orientation in (3, 4, 7, 8):
        pixels = pixels[::-1]
    if orientation in (2, 3, 6, 7):
        pixels = pixels[:, ::-1]
    return pixels


def _average_axis(values: Array, n: int, axis: int) -> Array:
    """Means over n equal intervals of an axis, by a sparse matrix of the overlap of pixels and intervals."""
    m = values.shape[axis]
    if m == n:
        return values
    edges = np.arange(n + 1) * (m / n)
    cuts = np.union1d(np.minimum(edges, m), np.arange(m + 1))
    interval = np.minimum(np.searchsorted(edges, cuts[:-1], side="right") - 1, n - 1)
    shares = csr_array((np.diff(cuts) * (n / m), (interval, cuts[:-1].astype(int))), shape=(n, m))
    lines = np.moveaxis(values, axis, 0)
    flat, out = lines.reshape(m, -1), np.empty((n, lines[0].size))
    step = max(1, int(AT_ONCE * n / flat.size))
    for start in range(0, n, step):  # the product makes doubles of all that it is given
        some = shares[start : start + step]
        first, last = int(some.indices.min()), int(some.indices.max()) + 1
        out[start : start + step] = some[:, first:last] @ flat[first:last]
    return np.moveaxis(out.reshape(n, *lines.shape[1:]), 0, axis)
