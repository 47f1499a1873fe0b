"""Guest: MediaPipe's face detector and hand landmarks in the place of the tracker."""
