"""`deixis certs`: the certificates of a site, by which routers know each other and know who may do what."""

from __future__ import annotations

import argparse
import json
from datetime import UTC, datetime, timedelta
from pathlib import Path
from typing import Any

from cryptography.hazmat.primitives import hashes
from deixis_runtime.access import ROLES, ROUTERS, Member, member_of
from deixis_runtime.certificates import SOON_DAYS, Certificates
from deixis_runtime.link_security import LinkSecurity, SecurityError, secure
from deixis_runtime.session import base_config

from . import authority
from .options import CommandError, add_json
from .site_certificates import CA_KEY, CERTIFICATE, Held, SiteFolder, held_on_host

MAX_DAYS = 36500
CA_DAYS, MEMBER_DAYS = 3650, 365
# Of Zenoh's settings, those that ours set; a zenohd has its own defaults for the rest.
SETTINGS = ("mode", "scouting", "listen", "connect", "transport", "access_control")
RULE = "a name has 57 letters, digits, '_', '.' and '-' at most, and does not begin with '.' or '-'"


def register(subparsers: Any) -> None:
    """Add the command with its actions."""
    parser = subparsers.add_parser("certs", help="make and show the certificates of a site", description=__doc__)
    actions = parser.add_subparsers(metavar="ACTION", required=True)
    init = _action(actions, "init", "make the CA of a site in a new folder", run_init, "folder of the site")
    _days(init, CA_DAYS)
    init.add_argument("--frames-stay", action="store_true", help="frames do not leave the robots (pictures of people)")
    issue = _action(actions, "issue", "make the certificate of one host or person", run_issue, "folder of the site")
    issue.add_argument("name", metavar="NAME", help="who it is; a robot's name is that of its keys")
    issue.add_argument("--role", required=True, choices=ROLES, help="what its holder may do: docs/security.md")
    issue.add_argument(
        "--host", action="append", default=[], metavar="NAME|IP", help="by which others reach its router; may be given again"
    )
    _days(issue, MEMBER_DAYS)
    renew = _action(actions, "renew", "make keys and certificates anew", run_renew, "folder of the site")
    renew.add_argument("members", nargs="*", type=_member, metavar="ROLE:NAME", help="whose")
    renew.add_argument("--all", action="store_true", help="of all members")
    _days(renew, MEMBER_DAYS)
    revoke = _action(actions, "revoke", "let a certificate count no more", run_revoke, "folder of the site")
    revoke.add_argument("member", type=_member, metavar="ROLE:NAME", help="whose")
    frames = _action(actions, "frames", "say whether frames stay on the robots of the site", run_frames, "folder of the site")
    frames.add_argument("where", choices=("stay", "travel"))
    zenohd = _action(actions, "zenohd", "print the settings of a stock zenohd for a host", run_zenohd, "a host's folder")
    zenohd.add_argument(
        "--config", type=Path, metavar="FILE", help="Zenoh settings (json5) to start from, e.g. config/edge.json5"
    )
    zenohd.add_argument("--frames-stay", action="store_true", help="let no frame leave this host (pictures of people)")
    show = _action(actions, "show", "who has which certificate, and until when", run_show, "folder of the site, or a host's")
    add_json(show, "print one JSON document")


def run_init(given: argparse.Namespace) -> int:
    """Make a site's CA."""
    site = SiteFolder(given.folder)
    site.create(_now(), timedelta(days=given.days), frames_stay=given.frames_stay)
    print(f"made the CA of a site in {site.path}; who has {site.path / CA_KEY} can let in anybody: keep it off other hosts")
    return 0


def run_issue(given: argparse.Namespace) -> int:
    """Make one member's certificate."""
    member = member_of(f"{given.role}:{given.name}")
    if member is None:
        raise CommandError(f"'{given.name[:80]}' is no name for a {given.role}: {RULE}")
    site = SiteFolder(given.folder)
    folder = site.issue(member, given.host, _now(), timedelta(days=given.days))
    print(f"{member}: copy {folder} to the host and name it there: --certs or DEIXIS_CERTS")
    _say_list(site, but=member)
    return 0


def run_renew(given: argparse.Namespace) -> int:
    """Make certificates anew."""
    site = SiteFolder(given.folder)
    members = site.members() if given.all else given.members
    if not members:
        raise CommandError("nobody is named: give ROLE:NAME, as 'deixis certs show' lists them, or --all")
    for member in members:
        folder = site.renew(member, _now(), timedelta(days=given.days))
        print(f"{member}: copy {folder} to the host again, and restart its router")
    return 0


def run_revoke(given: argparse.Namespace) -> int:
    """Take one member from the list."""
    site = SiteFolder(given.folder)
    site.revoke(given.member)
    print(f"{given.member} is off the list")
    _say_list(site)
    return 0


def run_frames(given: argparse.Namespace) -> int:
    """Set where frames may go."""
    site = SiteFolder(given.folder)
    site.keep_frames(given.where == "stay")
    print("frames stay on the robots" if given.where == "stay" else "frames may go from the robots to the edge")
    _say_list(site)
    return 0


def run_zenohd(given: argparse.Namespace) -> int:
    """Print what our router would use, as one JSON document. Raises CommandError or Unreachable."""
    security = LinkSecurity(Certificates(given.folder.resolve()), frames_stay=given.frames_stay)
    config = base_config("router", given.config)
    try:
        secure(config, security, guarded=True)
    except SecurityError as error:
        raise CommandError(str(error)) from None
    print(json.dumps({name: _set(json.loads(config.get_json(name))) for name in SETTINGS}, indent=1))
    return 0


def run_show(given: argparse.Namespace) -> int:
    """Show all certificates of a folder."""
    on_host = (given.folder / CERTIFICATE).exists()
    held = held_on_host(given.folder) if on_host else SiteFolder(given.folder).all_held()
    records = [record(item, _now()) for item in held]
    if given.json:
        print(json.dumps(records))
        return 0
    for item in records:
        hosts = f"  for {', '.join(item['hosts'])}" if item["hosts"] else ""
        print(f"{item['common_name']:<28} {say_standing(item):<42}{hosts}".rstrip())
    return 0


def record(held: Held, now: datetime) -> dict[str, Any]:
    """What is shown of a certificate.

    standing: ok, soon (it expires within a month), expired, early (not yet valid), or foreign (not of this CA).
    """
    certificate = held.certificate
    begins, ends = certificate.not_valid_before_utc, certificate.not_valid_after_utc
    standing = "expired" if now >= ends else "early" if now < begins else "ok"
    if standing == "ok" and ends - now < timedelta(days=SOON_DAYS):
        standing = "soon"
    return {
        "name": held.member.name if held.member else None,
        "role": held.member.role if held.member else None,
        "common_name": authority.common_name(certificate),
        "hosts": authority.hosts_of(certificate),
        "folder": str(held.folder),
        "not_before": begins.isoformat(),
        "not_after": ends.isoformat(),
        "expires_in_days": round((ends - now) / timedelta(days=1)),
        "standing": standing if held.signed else "foreign",
        "sha256": certificate.fingerprint(hashes.SHA256()).hex(),
    }


def say_standing(item: dict[str, Any]) -> str:
    """How a certificate stands, in words."""
    when = item["not_after"][:10]
    if item["standing"] == "foreign":
        return "is not of this CA: renew it"
    if item["standing"] == "expired":
        return f"EXPIRED on {when}: renew it"
    if item["standing"] == "early":
        return f"not valid before {item['not_before'][:16]}"
    days = item["expires_in_days"]
    return f"expires in {days} day{'' if days == 1 else 's'}, {when}{': renew it' if item['standing'] == 'soon' else ''}"


def _set(value: Any) -> Any:
    """A setting without those in it that are not set."""
    if isinstance(value, dict):
        return {name: _set(item) for name, item in value.items() if item is not None}
    return [_set(item) for item in value] if isinstance(value, list) else value


def _say_list(site: SiteFolder, but: Member | None = None) -> None:
    """A router that was given an older list does not know the newest member."""
    routers = [site.folder(member) / "access.json" for member in site.members() if member.role in ROUTERS and member != but]
    if routers:
        print(f"the list has changed: copy {', '.join(map(str, routers))} to those hosts, and restart their routers")


def _action(actions: Any, name: str, text: str, run: Any, folder: str) -> argparse.ArgumentParser:
    parser: argparse.ArgumentParser = actions.add_parser(name, help=text, description=text)
    parser.add_argument("folder", type=Path, metavar="DIR", help=folder)
    parser.set_defaults(run=run)
    return parser


def _days(parser: argparse.ArgumentParser, default: int) -> None:
    parser.add_argument("--days", type=_days_count, default=default, metavar="N", help="how long it holds (%(default)s)")


def _days_count(text: str) -> int:
    if not text.isdigit() or not 0 < int(text) <= MAX_DAYS:
        raise argparse.ArgumentTypeError(f"'{text[:20]}' is not a number of days from 1 to {MAX_DAYS}")
    return int(text)


def _member(text: str) -> Member:
    member = member_of(text)
    if member is None:
        raise argparse.ArgumentTypeError(f"'{text[:80]}' is not ROLE:NAME, as in robot:r1; {RULE}")
    return member


def _now() -> datetime:
    return datetime.now(UTC).replace(microsecond=0)
