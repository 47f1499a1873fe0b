"""What the runtime says of the certificates in a folder, by the standard library alone; and of the list of access."""

import re
import shutil
import subprocess
import sys
import time
from datetime import timedelta
from pathlib import Path

import pytest
from deixis_runtime.access import AccessError, Member, member_of, read_access
from deixis_runtime.certificate_check import DAY_S, CertificateError, examine, read
from deixis_runtime.certificates import Certificates, certificates_of
from site_made import add, make_site


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    """A site, another one, and folders of their members by name."""
    folder = tmp_path_factory.mktemp("certificates")
    site, other = make_site(folder / "site"), make_site(folder / "other")
    return {
        "edge": add(site, "edge:e1", "edge.local", "10.0.0.2"),
        "viewer": add(site, "viewer:anna"),
        "soon": add(site, "robot:soon", lasts=timedelta(days=20)),
        "expired": add(site, "robot:late", made_days_ago=9, lasts=timedelta(days=8)),
        "foreign": add(other, "edge:e1", "edge.local"),
    }


@pytest.fixture
def copy(made, tmp_path):
    """A folder of the edge that a test may spoil."""
    shutil.copytree(made["edge"].folder, tmp_path / "copy")
    return Certificates(tmp_path / "copy")


def test_a_certificate_is_read_without_a_library_for_it(made):
    edge = read(made["edge"])
    assert edge.member == Member("edge", "e1")
    assert edge.hosts == ("edge.local", "10.0.0.2")
    assert edge.ends_s - edge.begins_s == 366 * DAY_S
    assert read(made["viewer"]).member == Member("viewer", "anna"), "one that is for clients alone is read, too"
    alone = "import sys; sys.modules['cryptography'] = None; import deixis_runtime.certificate_check"
    assert subprocess.run([sys.executable, "-c", alone], check=False).returncode == 0


def test_dates_are_judged_by_the_day(made):
    now_s = time.time()
    assert examine(made["edge"], now_s).level == "ok"
    assert examine(made["soon"], now_s).level == "note"
    assert re.search(r"expires in (19|20) days", examine(made["soon"], now_s).what)
    assert examine(made["edge"], now_s + 340 * DAY_S).level == "note"
    over = examine(made["expired"], now_s)
    assert over.level == "wrong"
    assert "the certificate robot:late" in over.what
    assert "has expired 24 h 0 min ago" in over.what
    assert "deixis certs renew" in over.advice
    early = examine(made["edge"], now_s - 3 * DAY_S)
    assert early.level == "wrong"
    assert "not valid yet" in early.what
    assert "clock" in early.advice


def test_a_certificate_counts_no_longer_than_its_ca(tmp_path):
    site = make_site(tmp_path / "site")
    robot = add(site, "robot:r1", lasts=timedelta(days=10_000))
    assert read(robot).ends_s == pytest.approx(time.time() + 3550 * DAY_S, abs=DAY_S)


@pytest.mark.parametrize("name", ["ca.pem", "cert.pem", "key.pem"])
def test_a_missing_file_is_named(copy, name):
    (copy.folder / name).unlink()
    with pytest.raises(CertificateError, match=f"{name} is not there"):
        read(copy)


@pytest.mark.parametrize(
    ("name", "said"), [("ca.pem", "holds no certificate"), ("cert.pem", "damaged"), ("key.pem", "damaged")]
)
def test_a_damaged_file_is_named(copy, name, said):
    (copy.folder / name).write_text("-----BEGIN NONSENSE-----\n")
    with pytest.raises(CertificateError, match=said):
        read(copy)


def test_a_key_of_another_certificate_is_named(copy, made):
    shutil.copy(made["viewer"].key, copy.key)
    with pytest.raises(CertificateError, match=r"key.pem is not the key of .*cert.pem"):
        read(copy)


def test_a_certificate_of_another_ca_is_named(copy, made):
    shutil.copy(made["foreign"].ca, copy.ca)
    with pytest.raises(CertificateError, match=r"cert.pem is not of the CA in .*ca.pem"):
        read(copy)


def test_a_key_that_everybody_may_read_is_refused(copy):
    copy.key.chmod(0o644)
    with pytest.raises(CertificateError, match="may be read by everybody"):
        read(copy)
    copy.key.chmod(0o640)
    assert read(copy).common_name == "edge:e1"


def test_the_folder_is_named_by_the_environment():
    assert certificates_of({}) is None
    assert certificates_of({"DEIXIS_CERTS": ""}) is None
    assert certificates_of({"DEIXIS_CERTS": "/etc/deixis/certs"}) == Certificates(Path("/etc/deixis/certs"))


@pytest.mark.parametrize(
    "text", ["r1", "robot", "robot:", "robot:.x", "king:r1", "robot:a:b", "robot:r1\n", f"robot:{'x' * 58}"]
)
def test_a_common_name_that_is_not_of_a_site_is_nobody(text):
    assert member_of(text) is None


@pytest.mark.parametrize(
    ("content", "said"),
    [
        (None, "No such file"),
        ("", "EOF"),
        ("[]", "object"),
        ('{"members": ["r1"]}', "members.0"),
        ('{"members": [], "robots": []}', "unknown key"),
        ('{"members": []}' + " " * (1 << 20), "larger than"),
    ],
)
def test_a_list_that_cannot_be_used_is_named_with_the_cause(tmp_path, content, said):
    if content is not None:
        (tmp_path / "access.json").write_text(content)
    with pytest.raises(AccessError, match=r"access.json: ") as raised:
        read_access(tmp_path / "access.json")
    assert said in str(raised.value)
    assert "\n" not in str(raised.value)
