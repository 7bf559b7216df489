"""Check that damaged files are rejected with a reason, without a traceback and without large allocations."""

import hashlib
import os
import random
import tracemalloc

import h5py
import numpy as np
import pytest

from walkerlab.pipeline.store import artifact

PLENTY = 64 << 20


def sealed(image: bytes) -> bytes:
    """Return the bytes with a valid seal, so that only their content can be at fault."""
    return image + f"\nwalkerlab sha256 {hashlib.sha256(image).hexdigest()}\n".encode()


@pytest.fixture
def path(tmp_path, content, identity, origin):
    artifact.write(tmp_path / "a.h5", content, identity, origin)
    return tmp_path / "a.h5"


def refusal(path, key) -> str:
    """Return the reason why a file is rejected. Fail if it is accepted, or if the check takes much memory."""
    tracemalloc.start()
    try:
        verdict = artifact.check(path, key)
        peak = tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()
    assert not verdict.accepted
    assert verdict.damaged
    assert verdict.artifact is None
    assert verdict.reason.startswith("damaged: it")
    assert peak < PLENTY
    return verdict.reason


def test_truncated_file_is_rejected(path, identity):
    data = path.read_bytes()
    for length in sorted({0, 1, 8, 511, 2048, *range(0, len(data), 997), *range(len(data) - 90, len(data))}):
        path.write_bytes(data[:length])
        refusal(path, identity.key)


def test_file_with_a_flipped_bit_is_rejected(path, identity):
    data = path.read_bytes()
    chooser = random.Random(20)
    for position in [0, 7, 8, *chooser.sample(range(len(data)), 300), len(data) - 1]:
        altered = bytearray(data)
        altered[position] ^= 1 << chooser.randrange(8)
        path.write_bytes(altered)
        refusal(path, identity.key)


def test_file_edited_with_other_tools_is_rejected(path, identity):
    with h5py.File(path, "r+") as file:
        file["corrected/walk/time"][1] = 0.25
    refusal(path, identity.key)


@pytest.mark.parametrize("data", [b"", b"not HDF5 at all", b"\0" * 4096, b"\x89HDF\r\n\x1a\n" + b"\xff" * 4096])
@pytest.mark.parametrize("seal", [sealed, bytes], ids=["sealed", "bare"])
def test_file_that_is_not_hdf5_is_rejected(path, identity, data, seal):
    path.write_bytes(seal(data))
    refusal(path, identity.key)


def test_special_file_is_rejected_without_blocking(tmp_path, identity):
    (tmp_path / "folder").mkdir()
    refusal(tmp_path / "folder", identity.key)
    os.mkfifo(tmp_path / "pipe")
    refusal(tmp_path / "pipe", identity.key)
    (tmp_path / "device").symlink_to("/dev/zero")
    refusal(tmp_path / "device", identity.key)
    (tmp_path / "loop").symlink_to(tmp_path / "loop")
    refusal(tmp_path / "loop", identity.key)


def test_oversized_file_is_not_read(tmp_path, identity):
    path = tmp_path / "huge.h5"
    with path.open("wb") as file:
        file.truncate(10 << 30)
    assert "more than" in refusal(path, identity.key)


def test_file_without_read_permission_is_rejected(path, identity, unprivileged):
    path.chmod(0)
    with unprivileged():
        assert "cannot be read" in refusal(path, identity.key)


def declared_huge(file):
    file.create_dataset("corrected/walk/more", shape=(10 << 27,), dtype="f8")


def declared_huge_in_chunks(file):
    file.create_dataset("corrected/walk/more", shape=(10 << 27,), dtype="f8", chunks=(1 << 10,), compression="gzip")


def soft_link(file):
    file["corrected/walk/more"] = h5py.SoftLink("/corrected/walk/time")


def external_link(file):
    file["corrected/walk/more"] = h5py.ExternalLink("/etc/passwd", "/")


def external_storage(file):
    file["corrected/walk"].create_dataset("more", shape=(100,), dtype="f8", external=[("/dev/zero", 0, 800)])


def groups_in_a_circle(file):
    for name in ("b", "c", "d", "e"):
        file[f"corrected/{name}"] = file["corrected"]


def nested_deeply(file):
    file.create_group("/".join(["deeper"] * 200))


def single_precision(file):
    file["corrected/walk"].create_dataset("more", data=np.zeros(4, dtype="f4"))


def compound(file):
    file["corrected/walk"].create_dataset("more", data=np.zeros(4, dtype=[("a", "f8"), ("b", "i4")]))


def object_references(file):
    file["corrected/walk"].create_dataset("more", data=[file.ref], dtype=h5py.ref_dtype)


def named_type(file):
    file["corrected/walk/more"] = np.dtype("f8")


def empty_dataspace(file):
    file["corrected/walk"].create_dataset("more", data=h5py.Empty("f8"))


def array_outside_any_group(file):
    file.create_dataset("more", data=np.zeros(4))


def unit_is_a_number(file):
    file["corrected/walk/time"].attrs["units"] = 5


def attribute_is_an_array(file):
    file["corrected/walk"].attrs["more"] = np.zeros(1000)


def no_unit(file):
    del file["corrected/walk/time"].attrs["units"]


def no_scale(file):
    file["corrected/walk/state"].dims[0].detach_scale(file["corrected/walk/time"])


def value_changed(file):
    file["corrected/walk/state"][0, 0] = 1.0


def value_not_finite(file):
    file["corrected/walk/state"][0, 0] = np.nan


def array_taken_away(file):
    del file["corrected/walk/foot"]


def summary_changed(file):
    file.attrs["summary_json"] = "{}"


def summary_no_json(file):
    file.attrs["summary_json"] = "[" * 100_000


def summary_no_object(file):
    file.attrs["summary_json"] = "7"


def summary_no_text(file):
    file.attrs["summary_json"] = 7


def key_of_another(file):
    file.attrs["stage_key"] = "0" * 64


def input_forged(file):
    file.attrs["input_keys"] = '{"fixedpoint":"0"}'


def attribute_taken_away(file):
    del file.attrs["config_slice"]


@pytest.mark.parametrize(
    "alter",
    [
        declared_huge,
        declared_huge_in_chunks,
        soft_link,
        external_link,
        external_storage,
        groups_in_a_circle,
        nested_deeply,
        single_precision,
        compound,
        object_references,
        named_type,
        empty_dataspace,
        array_outside_any_group,
        unit_is_a_number,
        attribute_is_an_array,
        no_unit,
        no_scale,
        value_changed,
        value_not_finite,
        array_taken_away,
        summary_changed,
        summary_no_json,
        summary_no_object,
        summary_no_text,
        key_of_another,
        input_forged,
        attribute_taken_away,
    ],
)
def test_forged_content_is_rejected_even_with_a_valid_seal(path, identity, alter):
    with h5py.File(path, "r+") as file:
        alter(file)
    path.write_bytes(sealed(path.read_bytes()))
    refusal(path, identity.key)


def test_resealing_unchanged_content_is_accepted(path, identity):
    """This shows that the test above rejects files because of the change, not because of the new seal."""
    with h5py.File(path, "r+"):
        pass
    image = path.read_bytes()
    path.write_bytes(image if artifact.SEAL.fullmatch(image[-artifact.SEAL_BYTES :]) else sealed(image))
    assert artifact.check(path, identity.key).accepted


def test_strings_that_expand_too_much_are_not_read(path, identity):
    with h5py.File(path, "r+") as file:
        texts = file["corrected/walk"].create_dataset(
            "texts", data=["x" * 50_000, *["y"] * 4095], dtype=h5py.string_dtype()
        )
        file.flush()
        start = texts.id.get_offset()
    image = bytearray(path.read_bytes())
    image[start : start + 16 * 4096] = image[start : start + 16] * 4096
    path.write_bytes(sealed(bytes(image)))
    assert "more data than the file holds" in refusal(path, identity.key)


@pytest.mark.parametrize("version", [1, 10**6])
def test_file_of_another_layout_is_outdated_but_not_damaged(path, identity, version):
    with h5py.File(path, "r+") as file:
        file.attrs["schema_version"] = version
    path.write_bytes(sealed(path.read_bytes()))
    verdict = artifact.check(path, identity.key)
    assert not verdict.accepted
    assert not verdict.damaged
    assert "layout" in verdict.reason
