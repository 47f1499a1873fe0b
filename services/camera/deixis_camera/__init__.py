"""Deixis camera: devices, files and streams to frames."""

import os

# OpenCV reads these once, when it is first loaded or first opens a video, so they stand before any import of cv2. FFmpeg's
# and OpenCV's own lines on stderr go unstamped, repeat each second and hold URLs with passwords: our one line replaces them.
os.environ.setdefault("OPENCV_LOG_LEVEL", "SILENT")
os.environ.setdefault("OPENCV_FFMPEG_LOGLEVEL", "-8")
os.environ.setdefault("OPENCV_IO_MAX_IMAGE_PIXELS", str(8192 * 8192))
os.environ.setdefault("OPENCV_VIDEOIO_V4L_SELECT_TIMEOUT", "3")
