"""Guest: MediaPipe's hand landmarks in the place of gesture."""
