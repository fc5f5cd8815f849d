"""Series of DICOM as grades and cells: what a scanner's files say of place, order and values is kept."""

import numpy as np
import pytest
import trabecula as lt
from trabecula.io import dicom

pydicom = pytest.importorskip("pydicom")

SHAPE = (7, 5, 4)
ORIGIN = np.array([-3.0, 10.0, 200.0])
STEP = np.array([0.5, 0.75, 1.25])


def field(x, y, z):
    """Whole numbers at the nodes of the grid, other at each."""
    return 2 * x + 40 * y + 400 * z


def nodes():
    return [ORIGIN[a] + STEP[a] * np.arange(SHAPE[a]) for a in range(3)]


def dataset(position, along, spacing, pixels, series="1.2.3"):
    """A file of one picture as a scanner writes it."""
    from pydicom.dataset import FileMetaDataset
    from pydicom.uid import CTImageStorage, ExplicitVRLittleEndian

    meta = FileMetaDataset()
    meta.MediaStorageSOPClassUID = CTImageStorage
    meta.MediaStorageSOPInstanceUID = "1.2.3.4"
    meta.TransferSyntaxUID = ExplicitVRLittleEndian
    data = pydicom.Dataset()
    data.file_meta = meta
    data.SOPClassUID, data.SOPInstanceUID, data.SeriesInstanceUID = CTImageStorage, "1.2.3.4", series
    data.Modality = "CT"
    data.ImagePositionPatient, data.ImageOrientationPatient = list(map(float, position)), list(map(float, along))
    data.PixelSpacing = list(map(float, spacing))
    data.RescaleSlope, data.RescaleIntercept = 0.5, -1024.0
    stored = np.round((np.asarray(pixels) + 1024.0) / 0.5)
    data.Rows, data.Columns = stored.shape
    data.SamplesPerPixel, data.PhotometricInterpretation = 1, "MONOCHROME2"
    data.BitsAllocated, data.BitsStored, data.HighBit, data.PixelRepresentation = 32, 32, 31, 0
    data.PixelData = stored.astype("<u4").tobytes()
    return data


def write(folder, along=(1, 0, 0, 0, 1, 0), skip=(), series=lambda k: "1.2.3", tilt=None):
    """The field on the grid, as pictures whose rows and columns lie along signed axes; their names do not tell the order."""
    folder.mkdir(exist_ok=True)
    r, c = np.array(along[:3]), np.array(along[3:])
    directions = np.array([r, c, np.cross(r, c)])
    axes = np.abs(directions).argmax(axis=1)
    at = nodes()
    # The nodes along each direction, in the order in which it meets them.
    ways = [at[axes[d]][:: int(directions[d].sum())] for d in range(3)]
    for k, height in enumerate(ways[2]):
        if k in skip:
            continue
        place = np.zeros((len(ways[1]), len(ways[0]), 3))
        place[..., axes[0]] = ways[0][None, :]
        place[..., axes[1]] = ways[1][:, None]
        place[..., axes[2]] = height
        shown = along if tilt is None else (np.cos(tilt), np.sin(tilt), 0, -np.sin(tilt), np.cos(tilt), 0)
        spacing = STEP[axes[1]], STEP[axes[0]]
        data = dataset(place[0, 0], shown, spacing, field(*np.moveaxis(place, -1, 0)), series(k))
        data.save_as(folder / f"IM{(k * 3) % 7:04d}", enforce_file_format=True)
    return folder


AXIAL = (1, 0, 0, 0, 1, 0)


@pytest.mark.parametrize(
    "along", [AXIAL, (-1, 0, 0, 0, -1, 0), (0, 1, 0, 0, 0, -1), (1, 0, 0, 0, 0, -1), (0, 0, 1, 1, 0, 0), (0, -1, 0, 1, 0, 0)]
)
def test_values_stand_where_they_were_scanned(tmp_path, along):
    shape, origin, step, values = dicom.read(write(tmp_path / "ct", along))
    assert tuple(shape) == SHAPE
    assert np.allclose(origin, ORIGIN, atol=1e-9)
    assert np.allclose(step, STEP, atol=1e-9)
    x, y, z = np.meshgrid(*nodes(), indexing="ij")
    assert np.array_equal(values.reshape(SHAPE[::-1]).transpose(2, 1, 0), field(x, y, z))


def test_a_series_grades_a_lattice_where_it_was_scanned(tmp_path):
    write(tmp_path / "ct")
    far = ORIGIN + STEP * (np.array(SHAPE) - 1)
    low, high = field(*ORIGIN), field(*far)
    box = lt.region.box(min=ORIGIN.tolist(), max=far.tolist())

    def volume(fraction):
        core = lt.Lattice(cell="gyroid", part="sheet", map=lt.map.affine(wavelength=2), level=lt.level.fraction(fraction))
        return lt.Design(region=box, lattice=core, folder=str(tmp_path)).build().mesh(edge=0.1).volume

    # Linear in space, so it is the same between the nodes.
    formula = f"0.2 + 0.2 * (2*x + 40*y + 400*z - {low}) / {high - low}"
    scanned = volume(lt.grade.grid(path="ct/", remap=[[low, 0.2], [high, 0.4]]))
    assert scanned == pytest.approx(volume(lt.grade.formula(formula)), rel=1e-9)
    assert scanned != pytest.approx(volume(0.3), rel=1e-4)


def test_what_is_no_stack_is_refused(tmp_path):
    def refused(folder, **given):
        with pytest.raises(ValueError) as caught:
            dicom.read(folder, **given)
        assert "\n" not in str(caught.value)
        return str(caught.value)

    assert "is one missing" in refused(write(tmp_path / "gap", skip=(1,)))
    assert "holds 2 series, of 3, 1 pictures" in refused(write(tmp_path / "two", series=lambda k: f"1.2.{k // 3}"))
    assert "tilted 10.0 degrees" in refused(write(tmp_path / "tilted", tilt=np.radians(10)))
    (tmp_path / "empty").mkdir()
    assert "no DICOM files" in refused(tmp_path / "empty")
    (tmp_path / "text").mkdir()
    (tmp_path / "text" / "a.txt").write_text("no picture")
    assert "no pictures" in refused(tmp_path / "text")
    short = write(tmp_path / "short")
    file = short / "IM0003"
    file.write_bytes(file.read_bytes()[:-40])
    assert "damaged" in refused(short)
    assert "was stopped" in refused(write(tmp_path / "slow"), limit=0.001)


def test_frames_of_one_file_are_a_stack(tmp_path):
    """An enhanced object has all pictures in one file, with the place of each in a group of its own."""
    x, y, z = nodes()
    one = dataset(ORIGIN, AXIAL, STEP[[1, 0]], field(x[None, :], y[:, None], z[0]))
    layers = [field(x[None, :], y[:, None], h) for h in z]
    one.NumberOfFrames = len(layers)
    one.PixelData = np.round((np.stack(layers) + 1024.0) / 0.5).astype("<u4").tobytes()
    del one.ImagePositionPatient, one.ImageOrientationPatient, one.PixelSpacing
    group = pydicom.Dataset

    def with_one(of, **keys):
        inner, outer = group(), group()
        for key, value in keys.items():
            setattr(inner, key, value)
        setattr(outer, of, [inner])
        return outer

    shared = with_one("PixelMeasuresSequence", PixelSpacing=[STEP[1], STEP[0]])
    shared.PlaneOrientationSequence = with_one(
        "PlaneOrientationSequence", ImageOrientationPatient=list(map(float, AXIAL))
    ).PlaneOrientationSequence
    one.SharedFunctionalGroupsSequence = [shared]
    place = [with_one("PlanePositionSequence", ImagePositionPatient=[*map(float, ORIGIN[:2]), float(h)]) for h in z]
    one.PerFrameFunctionalGroupsSequence = place
    one.save_as(tmp_path / "all.dcm", enforce_file_format=True)
    shape, origin, step, values = dicom.read(tmp_path / "all.dcm")
    assert tuple(shape) == SHAPE
    assert np.allclose([*origin, *step], [*ORIGIN, *STEP], atol=1e-9)
    assert np.array_equal(values.reshape(SHAPE[::-1]), np.stack(layers))
