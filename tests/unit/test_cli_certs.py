"""`deixis certs`: what it makes, what it refuses, and what it says."""

import json
import stat
from datetime import UTC, datetime, timedelta

import pytest
from cryptography import x509
from cryptography.x509.oid import ExtendedKeyUsageOID
from deixis_cli import authority
from deixis_cli import main as command_line
from deixis_cli.certs import record, say_standing
from deixis_cli.site_certificates import SiteFolder
from deixis_runtime.access import member_of

NOW = datetime(2026, 11, 28, 12, tzinfo=UTC)
YEAR = timedelta(days=365)


def run(*arguments):
    return command_line.main(["certs", *map(str, arguments)])


@pytest.fixture
def site(tmp_path):
    folder = tmp_path / "site"
    assert run("init", folder) == 0
    assert run("issue", folder, "e1", "--role", "edge", "--host", "edge.local", "--host", "10.0.0.2") == 0
    assert run("issue", folder, "r1", "--role", "robot") == 0
    assert run("issue", folder, "anna", "--role", "viewer", "--days", "5") == 0
    return folder


def shown(capsys, folder):
    capsys.readouterr()
    assert run("show", folder, "--json") == 0
    return {item["common_name"]: item for item in json.loads(capsys.readouterr().out)}


def test_the_certificates_say_who_in_which_role_and_until_when(site, capsys):
    found = shown(capsys, site)
    assert set(found) == {"Deixis CA site", "edge:e1", "robot:r1", "viewer:anna"}
    assert found["edge:e1"]["hosts"] == ["edge.local", "10.0.0.2"]
    assert {name: item["standing"] for name, item in found.items() if item["role"]} == {
        "edge:e1": "ok", "robot:r1": "ok", "viewer:anna": "soon"
    }  # fmt: skip
    assert found["robot:r1"]["expires_in_days"] == 365
    assert run("show", site) == 0
    assert "expires in 5 days" in capsys.readouterr().out
    assert set(shown(capsys, site / "robot-r1")) == {"Deixis CA site", "robot:r1"}


def test_keys_are_for_their_owner_alone(site):
    keys = [site / "ca.key", *site.glob("*/key.pem")]
    assert len(keys) == 4
    assert {stat.S_IMODE(key.stat().st_mode) for key in keys} == {0o600}


def test_a_ca_and_a_certificate_are_never_overwritten(site, capsys):
    before = {path: path.read_bytes() for path in site.rglob("*.*") if path.is_file()}
    assert run("init", site) == 1
    assert "is never overwritten" in capsys.readouterr().err
    assert run("issue", site, "r1", "--role", "robot") == 1
    assert "'deixis certs renew' makes another one" in capsys.readouterr().err
    assert {path: path.read_bytes() for path in site.rglob("*.*") if path.is_file()} == before


def test_the_list_names_all_and_lies_with_every_router(site):
    listed = [json.loads((folder / "access.json").read_text()) for folder in (site, site / "edge-e1", site / "robot-r1")]
    assert listed == [{"members": ["edge:e1", "robot:r1", "viewer:anna"], "frames_stay": False}] * 3
    assert not (site / "viewer-anna" / "access.json").exists()


def test_who_is_revoked_is_off_every_list(site, capsys):
    assert run("revoke", site, "viewer:anna") == 0
    assert json.loads((site / "edge-e1" / "access.json").read_text())["members"] == ["edge:e1", "robot:r1"]
    assert not (site / "viewer-anna").exists()
    assert run("revoke", site, "viewer:anna") == 1
    assert "viewer:anna is not in" in capsys.readouterr().err


def test_frames_stay_by_a_setting_of_the_site(site, tmp_path):
    assert run("frames", site, "stay") == 0
    assert json.loads((site / "robot-r1" / "access.json").read_text())["frames_stay"] is True
    assert run("frames", site, "travel") == 0
    assert json.loads((site / "robot-r1" / "access.json").read_text())["frames_stay"] is False
    assert run("init", tmp_path / "private", "--frames-stay") == 0
    assert json.loads((tmp_path / "private" / "access.json").read_text())["frames_stay"] is True


def test_renewing_makes_another_key_for_the_same_holder_and_hosts(site, capsys):
    before = shown(capsys, site)["edge:e1"]
    key = (site / "edge-e1" / "key.pem").read_bytes()
    assert run("renew", site, "edge:e1", "--days", "700") == 0
    after = shown(capsys, site)["edge:e1"]
    assert after["sha256"] != before["sha256"]
    assert after["hosts"] == before["hosts"]
    assert after["expires_in_days"] == 700
    assert (site / "edge-e1" / "key.pem").read_bytes() != key
    assert (site / "edge-e1" / "access.json").exists()
    assert run("renew", site, "--all") == 0
    assert run("renew", site) == 1


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (("issue", "{site}", "e2", "--role", "edge"), "--host NAME"),
        (("issue", "{site}", "bob", "--role", "editor", "--host", "x"), "has no --host"),
        (("issue", "{site}", "e2", "--role", "edge", "--host", "a b"), "neither a host name nor an address"),
        (("issue", "{site}", ".x", "--role", "robot"), "is no name for a robot"),
        (("issue", "{site}", "x" * 58, "--role", "robot"), "57 letters"),
        (("issue", "{site}/none", "r2", "--role", "robot"), "'deixis certs init"),
        (("show", "{site}/none"), "No such file"),
    ],
)
def test_what_cannot_be_done_is_said_in_one_line(site, capsys, arguments, said):
    capsys.readouterr()
    assert run(*(part.format(site=site) for part in arguments)) == 1
    told = capsys.readouterr().err
    assert said in told
    assert told.count("\n") == 1


@pytest.mark.parametrize("days", ["0", "-1", "x", "36501"])
def test_days_have_bounds(tmp_path, days):
    with pytest.raises(SystemExit) as left:
        run("init", tmp_path / "site", "--days", days)
    assert left.value.code == 2


def test_a_certificate_that_another_ca_has_signed_is_shown_as_foreign(site, tmp_path, capsys):
    assert run("init", tmp_path / "other") == 0
    assert run("issue", tmp_path / "other", "r1", "--role", "robot") == 0
    (tmp_path / "other" / "robot-r1" / "cert.pem").rename(site / "robot-r1" / "cert.pem")
    assert shown(capsys, site)["robot:r1"]["standing"] == "foreign"


def test_a_certificate_ends_with_the_ca_and_begins_before_it_is_made():
    ca = authority.make_authority("s", NOW, timedelta(days=10))
    pair = authority.issue(ca, member_of("robot:r1"), [], NOW, YEAR)
    assert pair.certificate.not_valid_after_utc == NOW + timedelta(days=10)
    assert pair.certificate.not_valid_before_utc == NOW - timedelta(days=1)
    with pytest.raises(authority.AuthorityError, match="has expired"):
        authority.issue(ca, member_of("robot:r1"), [], NOW + YEAR, YEAR)


def test_only_who_has_hosts_can_pass_for_a_router():
    ca = authority.make_authority("s", NOW, YEAR)
    for name, hosts, serves in (("edge:e1", ["e"], True), ("robot:r1", [], False), ("viewer:v", [], False)):
        certificate = authority.issue(ca, member_of(name), hosts, NOW, YEAR).certificate
        uses = certificate.extensions.get_extension_for_class(x509.ExtendedKeyUsage).value
        assert (ExtendedKeyUsageOID.SERVER_AUTH in uses) is serves
        assert ExtendedKeyUsageOID.CLIENT_AUTH in uses
        assert certificate.extensions.get_extension_for_class(x509.BasicConstraints).value.ca is False


@pytest.mark.parametrize(("later", "standing"), [(0, "ok"), (340, "soon"), (366, "expired"), (-2, "early")])
def test_how_a_certificate_stands_depends_on_the_day(tmp_path, later, standing):
    site = SiteFolder(tmp_path / "site")
    site.create(NOW, 10 * YEAR, frames_stay=False)
    site.issue(member_of("robot:r1"), [], NOW, YEAR)
    found = record(site.held(member_of("robot:r1")), NOW + timedelta(days=later))
    assert found["standing"] == standing
    assert (say_standing(found).count("renew it") == 1) is (standing in ("soon", "expired"))
