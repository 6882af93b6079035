"""Files are complete or unchanged on a full disk, and if the process is killed while it writes."""

import subprocess
import sys
import time
from pathlib import Path

import bpy
import numpy as np
import pytest
from beamspread.blender.images import files
from beamspread.core.batch.report import BakeRecord, Report
from beamspread.core.errors import ImageError
from scenes import add_material, add_plane, add_sun, bake, messages_of, node_of, pixels, run_batch, select

from full_disk import full_after

SIDE = 64
NOISE = np.random.default_rng(0).random((SIDE, SIDE, 3), np.float32)


def saved_image(path, file_format, side=SIDE, is_float=False):
    """An image with a file of its own, gray noise."""
    image = bpy.data.images.new("Target", side, side, float_buffer=is_float)
    files.set_pixels(image, np.random.default_rng(2).random((side, side, 3), np.float32))
    image.filepath_raw, image.file_format = str(path), file_format
    image.save()
    bpy.data.images.remove(image)
    return bpy.data.images.load(str(path))


FILE_FORMATS = {"PNG": ".png", "JPEG": ".jpg", "TARGA": ".tga", "TARGA_RAW": ".tga", "BMP": ".bmp", "TIFF": ".tif"} | {
    "OPEN_EXR": ".exr",
    "HDR": ".hdr",
}


@pytest.mark.parametrize("file_format", FILE_FORMATS)
def test_the_file_of_an_image_keeps_its_format_and_is_whole_or_old(tmp_path, file_format):
    path = tmp_path / f"target{FILE_FORMATS[file_format]}"
    image = saved_image(path, file_format, is_float=file_format in ("OPEN_EXR", "HDR"))
    before, shown = path.read_bytes(), pixels(image)
    bound = 0.2 if file_format == "JPEG" else 0.02
    whole = path.with_stem("whole")
    sample = saved_image(whole, file_format, is_float=image.is_float)
    files.fill_image(sample, NOISE * 0.5)
    size = whole.stat().st_size
    bpy.data.images.remove(sample)
    whole.unlink()
    # The disk is full near the end of the file, in its middle, and in its header.
    for limit in (int(0.93 * size), size // 2, 50):
        with full_after(limit), pytest.raises(ImageError, match=f"target{path.suffix} cannot be written and stays"):
            files.fill_image(image, NOISE * 0.5)
        assert path.read_bytes() == before
        assert np.array_equal(pixels(image), shown)
        assert list(tmp_path.iterdir()) == [path]
    assert files.fill_image(image, NOISE * 0.5) == str(path)
    assert list(tmp_path.iterdir()) == [path]
    assert len(bpy.data.images) == 1
    expected = NOISE * 0.5 if image.is_float else files.to_srgb(NOISE * 0.5)
    for written in (image, bpy.data.images.load(str(path), check_existing=False)):
        assert np.abs(pixels(written) - expected).mean() < bound
    assert image.file_format == file_format.removesuffix("_RAW") or file_format == "TARGA_RAW"


@pytest.mark.parametrize("file_format", files.EXTENSIONS)
@pytest.mark.parametrize("part", [0.01, 0.5, 0.999])
def test_an_output_is_whole_or_old(tmp_path, file_format, part):
    path = tmp_path / f"out{files.EXTENSIONS[file_format]}"
    files.write_file(path, 1 - NOISE, file_format)
    size = path.stat().st_size
    files.write_file(path, NOISE, file_format)
    before = path.read_bytes()
    for target in (path, tmp_path / "new" / path.name):
        with full_after(int(part * size)), pytest.raises(ImageError, match=r"too large|not all of it"):
            files.write_file(target, 1 - NOISE, file_format)
    assert path.read_bytes() == before
    assert [*tmp_path.rglob("*.*")] == [path]


def test_a_bake_on_a_full_disk_fails_and_the_image_stays(tmp_path):
    bpy.context.scene.beamspread.resolution = 128
    image = saved_image(tmp_path / "own.bmp", "BMP", 128)  # large, however smooth
    plane = add_plane(material=add_material(image=image))
    add_sun(0)
    before = pixels(image)
    select(plane)
    with full_after(20000):
        assert "own.bmp cannot be written" in messages_of(bpy.ops.beamspread.bake)
        report = run_batch("--output", tmp_path / "out")
    assert [record.status for record in report.bakes] == ["failed"]
    assert "cannot be written" in report.bakes[0].message
    assert not [*(tmp_path / "out").iterdir()]
    assert np.array_equal(pixels(image), before)
    assert not np.array_equal(bake(plane)[0], before)
    assert node_of(plane.data.materials[0]).image == image


def test_a_really_full_disk(tmp_path):
    disk = tmp_path / "disk"
    disk.mkdir()
    mount = ["mount", "-t", "tmpfs", "-o", "size=64k", "none", str(disk)]
    if subprocess.run(mount, capture_output=True, check=False).returncode:
        pytest.skip("mounting a small disk takes an administrator")
    try:
        for file_format in files.EXTENSIONS:
            old = disk / f"{file_format}{files.EXTENSIONS[file_format]}"
            small = NOISE[:16, :16]
            files.write_file(old, small, file_format)
            before = old.read_bytes()
            large = np.random.default_rng(3).random((256, 256, 3), np.float32)
            with pytest.raises(ImageError, match=r"cannot be written.*(No space left|not all of it)"):
                files.write_file(old, large, file_format)
            assert old.read_bytes() == before
        assert len(list(disk.iterdir())) == len(files.EXTENSIONS)
    finally:
        subprocess.run(["umount", "-l", str(disk)], check=True)


def test_a_report_is_whole_or_old(tmp_path):
    path = tmp_path / "report.json"
    Report([BakeRecord("A")]).save(str(path))
    before = path.read_text()
    with full_after(1000), pytest.raises(OSError, match="large"):
        Report([BakeRecord(name) for name in "ABCDEFGHIJK"]).save(str(path))
    assert path.read_text() == before
    assert list(tmp_path.iterdir()) == [path]


@pytest.mark.parametrize("file_format", ["PNG", "OPEN_EXR"])
def test_a_process_that_is_killed_while_it_writes_leaves_the_old_file(tmp_path, file_format):
    side = 1024  # takes a while to write
    path = tmp_path / f"own{FILE_FORMATS[file_format]}"
    saved_image(path, file_format, side, is_float=file_format == "OPEN_EXR")
    script = [str(Path(__file__).with_name("kept_child.py")), "--", str(path)]
    blender = [bpy.app.binary_path, "-b", "--factory-startup", "--python"]
    command = [*blender, *script] if bpy.app.binary_path else [sys.executable, *script]
    for _ in range(2):
        before = path.read_bytes()
        child = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        try:
            # Kill the process when a file of the folder is written in part.
            deadline = time.monotonic() + 60
            while not begun(path, len(before)):
                assert child.poll() is None
                assert time.monotonic() < deadline
        finally:
            child.kill()
            child.wait()
        image = bpy.data.images.load(str(path), check_existing=False)
        assert tuple(image.size) == (side, side)
        assert (pixels(image).std(axis=(1, 2)) > 0.1).all()  # noise in every row
        assert file_format != "PNG" or b"IEND" in path.read_bytes()[-12:]
        for rest in tmp_path.iterdir():
            if rest != path:
                rest.unlink()


def begun(path, whole):
    """True if a file of the folder is written in part: more than its header and less than half."""
    try:
        return any(1000 < file.stat().st_size < whole // 2 for file in path.parent.iterdir())
    except FileNotFoundError:  # renamed just now
        return False


def test_a_link_stays_one_and_a_file_keeps_its_mode(tmp_path):
    (tmp_path / "there").mkdir()
    real, link = tmp_path / "there" / "real.exr", tmp_path / "link.exr"
    files.write_file(real, NOISE, "EXR")
    real.chmod(0o640)
    link.symlink_to(real)
    files.write_file(link, 1 - NOISE, "EXR")
    assert link.is_symlink()
    assert real.stat().st_mode & 0o777 == 0o640
    assert pixels(bpy.data.images.load(str(real))) == pytest.approx(1 - NOISE, abs=1e-6)
