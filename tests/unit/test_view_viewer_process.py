"""What Rerun's viewer is said to have ended of."""

from deixis_view.viewer_process import last_words

AT_EASE = "2026-11-28T14:16:07.599217Z  INFO re_grpc_server: Listening for gRPC connections on 127.0.0.1:47421.\n"


def test_what_went_wrong_is_said_without_what_is_told_when_all_is_well():
    error = "Error: Trying to spawn a Web Viewer server on 56603, but this port is already used."
    assert last_words(f"{AT_EASE}{error}\n{AT_EASE}\n") == error


def test_a_viewer_that_told_of_nothing_wrong_did_not_say_why():
    assert last_words(AT_EASE * 3) == last_words("") == "it did not say why"
