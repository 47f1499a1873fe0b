"""Whether pictures can be rendered here: EGL and Mesa are no Python packages."""

import pytest


def _why_not():
    try:
        import moderngl

        moderngl.create_context(standalone=True, backend="egl").release()
    except Exception as error:
        return f"no OpenGL without a display here (apt install libegl1 libgl1-mesa-dri): {error}"
    return ""


WHY_NOT = _why_not()
needs_renderer = pytest.mark.skipif(bool(WHY_NOT), reason=WHY_NOT)
