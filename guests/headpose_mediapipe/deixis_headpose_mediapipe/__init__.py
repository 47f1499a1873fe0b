"""Guest: MediaPipe's FaceMesh and PnP in the place of headpose."""
