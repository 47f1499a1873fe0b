"""Programs that link to a router, and what each has heard: for tests of who may do what."""

from running import wait_until

PATIENCE_S = 30.0


class Party:
    """A session of somebody, and what it has heard: key and payload."""

    def __init__(self, session):
        self.session = session
        self.heard = []
        self._declared = []

    def listen(self, expression):
        def note(sample):
            self.heard.append((str(sample.key_expr), sample.kind, sample.payload.to_bytes()))

        self._declared.append(self.session.declare_subscriber(expression, note))

    def serve(self, expression):
        self._declared.append(self.session.declare_queryable(expression, lambda q: q.reply(q.key_expr, b"answer")))

    def live(self, expression):
        self._declared.append(self.session.liveliness().declare_token(expression))

    def follow(self, expression):
        def note(sample):
            self.heard.append((str(sample.key_expr), sample.kind, b""))

        self._declared.append(self.session.liveliness().declare_subscriber(expression, note, history=True))

    def put(self, expression, payload=b"x"):
        self.session.put(expression, payload)

    def asks(self, selector):
        return [r.ok.payload.to_bytes() for r in self.session.get(selector, timeout=0.5) if r.ok is not None]

    def names(self):
        return {key for key, _, _ in self.heard}


def until_heard(listener, expression, send):
    """Send again and again until the listener has heard it: a subscription takes a moment on its way."""

    def heard():
        send()
        return expression in listener.names()

    wait_until(heard, f"{expression} is heard", PATIENCE_S)
