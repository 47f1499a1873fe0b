"""What the commands say in one line where they are not given what they need: a foreign port, no robot, no frames."""

import json
import socket
import threading
from contextlib import contextmanager

import pytest
from deixis_cli.main import main
from deixis_cli.options import CommandError
from deixis_conformance.command import refuse_unseen
from running import free_port
from site_made import add, holder, make_site


@contextmanager
def program_that_says(greeting):
    """Some other program's port: its endpoint."""
    with socket.create_server(("127.0.0.1", 0)) as server:

        def serve():
            while True:
                try:
                    connection, _ = server.accept()
                except OSError:
                    return
                with connection:
                    connection.sendall(greeting)

        threading.Thread(target=serve, daemon=True).start()
        yield f"tcp/127.0.0.1:{server.getsockname()[1]}"
        server.shutdown(socket.SHUT_RDWR)


@pytest.mark.parametrize(
    ("greeting", "said"),
    [
        (b"SSH-2.0-OpenSSH_9.2p1\r\n", "is not a Zenoh router: it says 'SSH-2.0-OpenSSH_9.2p1'"),
        (b"", "is not a Zenoh router: the port belongs to another program"),
    ],
)
def test_status_says_of_a_port_of_another_program_that_it_is_that(greeting, said, capsys):
    with program_that_says(greeting) as endpoint:
        assert main(["status", "--robot", "r1", "--connect", endpoint]) == 1
    (line,) = capsys.readouterr().err.splitlines()
    assert line.startswith(f"deixis: no session with {endpoint}: what listens at {endpoint} {said}")


def test_status_says_of_a_port_that_nobody_has_that_no_router_answers(capsys):
    assert main(["status", "--robot", "r1", "--connect", f"tcp/127.0.0.1:{free_port()}"]) == 1
    (line,) = capsys.readouterr().err.splitlines()
    assert "no Zenoh router answers at" in line


def test_doctor_looks_at_this_machine_without_the_name_of_a_robot(capsys):
    main(["doctor", "--local", "--json"])
    document = json.loads(capsys.readouterr().out)
    assert document["robot"] is None
    assert document["findings"]


def test_doctor_wants_the_name_of_a_robot_to_look_at_its_system(capsys):
    assert main(["doctor", "--connect", f"tcp/127.0.0.1:{free_port()}"]) == 1
    assert "--robot NAME is needed" in capsys.readouterr().err


def test_a_camera_is_not_checked_by_a_certificate_that_is_given_no_frames(tmp_path):
    site = make_site(tmp_path / "site")
    viewer, edge = add(site, "viewer:anna"), add(site, "edge:pc", "127.0.0.1")
    guarded = "tls/127.0.0.1:7448"
    with holder(viewer):
        with pytest.raises(CommandError, match="the certificate of viewer:anna is given no frames"):
            refuse_unseen("camera", guarded)
        refuse_unseen("gesture", guarded)
        refuse_unseen("camera", "tcp/127.0.0.1:7447")
    with holder(edge):
        refuse_unseen("camera", guarded)
